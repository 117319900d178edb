// Scenes: one call checks and stores the arguments.
#include "times.hpp"

// Returns a vector as Python stores it. Vectors that were not given share one tuple of zeros.
static py::object vector_of(const py::object &given, const double (&v)[3])
{
    static const py::tuple &zeros = *new py::tuple(py::make_tuple(0.0, 0.0, 0.0));
    return given.is_none() ? zeros : py::make_tuple(v[0], v[1], v[2]);
}
// Returns the numbers of a scene as Python stores them, and its block: momentum, attitude, gravity,
// damping, turning, shaking, friction, block. Returns None if an argument does not consist of plain
// numbers. Returns the name of the status if the scene is invalid. Arguments may be None, except
// momentum and gravity.
static py::object scene(const kr_body &body, const py::object &momentum, const py::object &attitude,
                        const py::object &gravity, const py::object &damping,
                        const py::object &turning, const py::object &shaking,
                        const py::object &friction)
{
    double m[3], q[4] = {1.0, 0.0, 0.0, 0.0}, d[3] = {}, u[3] = {}, k[3] = {}, f = 0.0, g;
    if (!plain_number(gravity.ptr(), g) || !numbers_of(momentum, m)) return py::none();
    if (!attitude.is_none() && !numbers_of(attitude, q)) return py::none();
    if (!damping.is_none() && !numbers_of(damping, d)) return py::none();
    if (!turning.is_none() && !numbers_of(turning, u)) return py::none();
    if (!shaking.is_none() && !numbers_of(shaking, k)) return py::none();
    if (!friction.is_none() && !plain_number(friction.ptr(), f)) return py::none();
    const kr_scene s = {body,
                        g,
                        {0.0, {q[0], q[1], q[2], q[3]}, {m[0], m[1], m[2]}},
                        {d[0], d[1], d[2]},
                        {u[0], u[1], u[2]},
                        {k[0], k[1], k[2]},
                        f};
    const kr_status status = kr_scene_check(&s);
    if (status != KR_OK) return py::str(name_of(status));
    return py::make_tuple(vector_of(momentum, m), py::make_tuple(q[0], q[1], q[2], q[3]), g,
                          vector_of(damping, d), vector_of(turning, u), vector_of(shaking, k), f,
                          block_of(s));
}

void bind_scene(py::module_ &m);
void bind_scene(py::module_ &m)
{
    m.def("scene_horizon", [](const kr_scene &s) { return kr_scene_horizon(&s); }, "scene"_a);
    m.def("scene", scene, "body"_a, "momentum"_a, "attitude"_a, "gravity"_a, "damping"_a,
          "turning"_a = py::none(), "shaking"_a = py::none(), "friction"_a = py::none());
}
