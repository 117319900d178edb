"""A script whose type errors are marked by comments."""

import kreisel as kr

scene = kr.scenes.thesis
path = kr.solve(scene, 1.0)
kr.solve(scene, 1, "taylr")  # wrong
kr.start(scene, "geometric")  # wrong
kr.stream(scene, [1.0], "strnag", step=0.1)  # wrong
kr.plan(scene, method="rk5")  # wrong
kr.compare(scene, 1, methods=["rk5"])  # wrong
kr.solve(scene, 1, want=("energi",))  # wrong
kr.start(scene, want=["enrgy"])  # wrong
path.only(("apx",))  # wrong
print(path.enregy)  # wrong
print(kr.solve(scene, 1.0).events.times)  # wrong
kr.solve(scene, "10")  # wrong
kr.solve(scene, ["10"])  # wrong
kr.start(scene).to("10")  # wrong
kr.start(scene).reset(spin=1.0)  # wrong
kr.start(scene).change(gravity=1.0, keep="spin")  # wrong
kr.start(scene).change(body=scene)  # wrong
kr.exact(scene)("10")  # wrong
path("10")  # wrong
kr.solve(scene, 1, stpe=0.1)  # wrong
kr.solve(scene, 1, "strang", step="0.1")  # wrong
scene.replace(gravty=2)  # wrong
scene.replace(gravity="2")  # wrong
kr.events.plane((0, 1, 0), max_cuont=3)  # wrong
kr.solve(scene, 1, events=["loop"])  # wrong
kr.start(scene, events=kr.events.loop)  # wrong
path.energy = path.t  # wrong
scene.vary(spn=1.0)  # wrong
kr.Scene(scene.body, momntum=[(0, 0, 1)], gravity=1)  # wrong
kr.Scene.stack([scene]).momentum = path.m  # wrong
kr.reduce(kr.Scene.stack([scene]), 1, {"spin": "most"})  # wrong
print(kr.reduce(kr.Scene.stack([scene]), 1, {"spin": "max"}).nutation)  # wrong
kr.stream(scene, 1, executor=3)  # wrong
