"""
How do I put a top into my own program in C?
============================================

Include ``kreisel.h`` and link the library, which needs only libc and libm. It is suitable for games
and controllers, because it has no global state, prints nothing, and allocates memory only once for
each top.
"""

import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

PROGRAM = r"""
#include <kreisel.h>
#include <stdio.h>

int main(void)
{
    kr_scene scene = kr_scene_default();
    kr_config config = {.step = 0.01};
    kr_top *top;
    kr_status status = kr_top_create(&scene, kr_method_find("bobenko_suris2"), config, &top);
    for (int frame = 0; status == KR_OK && frame <= 1500; frame++) {
        status = kr_top_advance(top, frame / 50.0);
        kr_state s = kr_top_state(top);
        kr_vec3 a = kr_state_apex(&scene, &s);
        printf("%g %.17g %.17g %.17g\n", s.t, a.x, a.y, a.z);
    }
    kr_top_free(top);
    return status;
}
"""

# %%
# After ``cmake --install``, compile it with
# ``cc -std=c99 top.c $(pkg-config --cflags --libs kreisel)``. Here the library is in
# ``KREISEL_PREFIX``:

prefix = Path(os.environ["KREISEL_PREFIX"])
with TemporaryDirectory() as folder:
    source, program = Path(folder) / "top.c", Path(folder) / "top"
    source.write_text(PROGRAM)
    options = [f"-I{prefix}/include", f"-L{prefix}/lib", f"-Wl,-rpath,{prefix}/lib"]
    subprocess.run(
        ["cc", "-std=c99", source, "-o", program, *options, "-lkreisel", "-lm"], check=True
    )
    output = subprocess.run([program], check=True, capture_output=True, text=True).stdout
print("\n".join(output.splitlines()[:3]))

t, x, y, z = np.array([line.split() for line in output.splitlines()], dtype=float).T
figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), width_ratios=(2, 3), layout="constrained")
axes[0].plot(x, y, linewidth=0.8)
axes[0].set(aspect="equal", title="the apex from above")
axes[1].plot(t, z)
axes[1].set(xlabel="time", title="height of the apex")

# %%
# The header can also be used in C++. With CMake, use ``find_package(kreisel)`` and
# ``kreisel::kreisel``.
