"""
Which frequencies are in a motion?
==================================

The spectrum of a regular motion has sharp lines at three frequencies and their combinations. The
spectrum of a chaotic motion has no lines. Both are computed from a path with equal time steps.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

t = np.linspace(0, 400, 8001)
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7.6, 4.8), layout="constrained")
for chart, name in zip(axes, ("cusps", "asymmetric"), strict=True):
    path = kr.solve(kr.scenes.get_scene(name), t, "taylor")
    window = np.hanning(len(t))
    signal = window * (path.apex[:, 0] + 1j * path.apex[:, 1])
    power = np.abs(np.fft.fftshift(np.fft.fft(signal))) / window.sum()
    line = np.fft.fftshift(np.fft.fftfreq(len(t), t[1])) * 2 * np.pi
    chart.semilogy(line, power, linewidth=0.7)
    frequencies = kr.frequencies(path)
    if frequencies.rest < 1e-6:
        chart.plot(frequencies.lines, np.abs(frequencies.amplitudes), "o", markersize=4)
    chart.set(ylabel=name, ylim=(1e-9, 2), xlim=(-12, 12))
    print(f"{name}: twelve lines leave a residual of {frequencies.rest:.1e} ")
axes[1].set_xlabel("angular frequency of the apex about the vertical")

# %%
# Laskar's frequency analysis finds the lines far more accurately than the resolution of the
# spectrum. The closed form confirms this:

frequencies = kr.frequencies(kr.solve(kr.scenes.cusps, t, "taylor"))
truth = kr.exact(kr.scenes.cusps)
print(frequencies)
print(f"precession off by {abs(frequencies.precession_rate / truth.precession_rate - 1):.1e}")
print(f"nutation off by {abs(frequencies.nutation * truth.period / (2 * np.pi) - 1):.1e}")
