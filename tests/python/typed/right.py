"""An example script in which type checkers must not report any errors."""

import itertools
import tempfile

import kreisel as kr
import numpy as np
from kreisel.types import MethodName, QuantityName

body = kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1))
scene = kr.Scene(body, momentum=(0.172, -1.862, 1.46), gravity=1)
heavier = scene.replace(gravity=2.0, momentum=np.array([1.0, 2.0, 3.0]))
times = np.linspace(0, 10, 11)
for t in (10, 10.0, [1, 2.5], (1, 2), range(3), times, np.arange(3), np.float32(3), np.int64(2)):
    path = kr.solve(scene, t, "taylor")
several = kr.solve(scene, [np.float64(1), np.float64(2)], want=("energy", "apex", "t"))
nutation_path = kr.solve(scene, 3, want=["nutation"], method="geometric", error=1e-3)
name: MethodName = "strang"
names: list[QuantityName] = ["energy", "spin"]
named_path = kr.solve(scene, 1.0, name, step=0.1, want=names)
again = kr.solve(scene, 1.0, named_path.method, step=0.1, want=named_path.want)
print(path.energy.max(), path.velocity[0], path.q_low, path.error, path[0].apex, path(0.5).t)
for method in kr.methods.values():
    if method.suits(scene) and not method.adaptive:
        kr.solve(scene, 1, method.name, step=0.01)
for method_name in kr.methods:
    if kr.methods[method_name].suits(scene):
        kr.plan(scene, 1, method=method_name, step=0.01)
watched = kr.solve(heavier, 9, events=[kr.events.nutation(), kr.events.crossing("spin", 1.0)])
print(watched.events.t, watched.events.path.energy, len(watched.events))
one = kr.solve(heavier, 9, events=kr.events.plane((0, 1, 0), max_count=3, terminal=True))
print(one.events.which)
run = kr.start(scene, events=[kr.events.loop(where={"apex_z": 1.0})], want=("energy",))
print(run.to([1, 2]).events.direction, [piece.events.t for piece in run.stream([3.0])])
print([piece.events.t for piece in kr.stream(scene, times, events=[kr.events.loop()])])
endless = kr.stream(scene, (0.1 * k for k in itertools.count()), want=("energy",))
print(next(endless).energy, len(kr.start(scene).to(3).events))
pushed_run = kr.start(scene, "taylor")
pushed_run.push((0.1, 0.0, 0.2))
pushed_run.push(np.array([0.1, 0.0, 0.2]))
pushed_run.reset(momentum=(1, 2, 3), attitude=(1, 0, 0, 0))
pushed_run.reset(body_velocity=np.ones(3))
pushed_run.change(body=body, gravity=2.0, damping=0.1, keep="velocity")
print(pushed_run.start_time + pushed_run.to(1.0).start_time)
closed = kr.exact(scene)
print(closed(times).apex, closed([1, 2]).q, kr.exact([scene])(1.0).nutation)
table = kr.compare(scene, 10, methods=["rk4", "taylor"], steps=[0.1], truth="exact")
print(table[0].method, kr.methods["taylor"].order)
tops = kr.Scene(body, momentum=np.ones((3, 3)), gravity=[1.0, 2.0, 3.0], damping=0.1)
print(
    tops[::2].shape, tops[[0, 1]].axes, tops.reshape(3, 1).momentum[0], [top.body for top in tops]
)
ensemble = scene.vary(spin=np.linspace(0, 5, 3)[:, None], tilt=[0.1, 0.2], degrees=False)
print(ensemble.coords["spin"], ensemble.attitude.max(), scene.scatter(5, seed=1, attitude=0.1).size)
bodies = kr.Body.cone(radius=[1, 2], height=2, pivot=(0, 0, 0), mass=1)
print(
    kr.Scene.spinning(bodies, 5.0, gravity=1).body,
    bodies.moments,
    kr.Scene.stack([scene]).gravity,
)
paths = kr.solve(tops, times, want=("nutation",), threads=2)
print(paths.nutation.max(), paths.failed, paths.check().status, paths.message(0), paths.t.shape)
reductions = kr.reduce(tops, 10, {"nutation": ("min", "max"), "apex_z": "mean"})
print(reductions["nutation"]["max"].shape, reductions.stats.steps.sum(), kr.plan(tops, 10).seconds)
print([piece.q.shape for piece in kr.stream(tops, [1, 2], chunk=2)], kr.exact(tops[:0]).period)
source = kr.Source.grid(scene, spin=np.linspace(0, 5, 3), tilt=[0.1, 0.2])
print(
    source[1:3].gravity,
    source[0].body,
    len(kr.Source.of(tops)),
    kr.Source.random(scene, 5, spin=(0, 1)),
)
with tempfile.TemporaryDirectory() as folder:
    sweep = kr.sweep(source, 10, folder=folder, reduce={"nutation": "max"}, parts=range(1))
    print(sweep["nutation_max"].max(), kr.read_sweep(folder, partial=True).present, sweep.units)
try:
    kr.solve(tops, 10).check()
except kr.Error as error:
    print(error.path.t, error.result.failed)
record = kr.Record(times, {"apex": kr.solve(scene, times).apex}, sigma=0.1, free="delay")
fit = kr.fit(scene, [record], ("start", "lever"), loss="soft", max_evaluations=50)
value, sigma = fit.error_of(lambda top: top.body.moments)
print(fit.values["lever"], fit.error, value, sigma, fit.scatter(3).shape, fit.path.t)
print(fit.unidentified, fit.moment_ratios, fit.scene.to_toml(), fit.to_toml())
