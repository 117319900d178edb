// Scenes: one call checks and stores the arguments.
#include "times.hpp"

// Reads doubles from a tuple or list of numbers, or from an array of doubles. Returns false for
// anything else.
template <size_t n> static bool numbers_of(const py::handle &given, double (&to)[n])
{
    given_times row;
    if (!row.take(given) || row.is_number || row.size() != n) return false;
    std::memcpy(to, row.data(), sizeof to);
    return true;
}
// Returns the block of a scene, with its momentum, attitude, gravity and damping as Python stores
// them. Returns None if an argument does not consist of plain numbers. Returns the name of the
// status if the scene is invalid.
static py::object scene(const kr_body &body, const py::object &momentum, const py::object &attitude,
                        const py::object &gravity, const py::object &damping)
{
    double m[3], q[4] = {1.0, 0.0, 0.0, 0.0}, d[3] = {0.0, 0.0, 0.0}, g;
    if (!plain_number(gravity.ptr(), g) || !numbers_of(momentum, m)) return py::none();
    if (!attitude.is_none() && !numbers_of(attitude, q)) return py::none();
    if (!damping.is_none() && !numbers_of(damping, d)) return py::none();
    const kr_scene s = {body,
                        g,
                        {0.0, {q[0], q[1], q[2], q[3]}, {m[0], m[1], m[2]}},
                        {d[0], d[1], d[2]},
                        {0.0, 0.0, 0.0},
                        {0.0, 0.0, 0.0},
                        0.0};
    const kr_status status = kr_scene_check(&s);
    if (status != KR_OK) return py::str(name_of(status));
    return py::make_tuple(py::make_tuple(m[0], m[1], m[2]), py::make_tuple(q[0], q[1], q[2], q[3]),
                          g, py::make_tuple(d[0], d[1], d[2]), block_of(s));
}

void bind_scene(py::module_ &m);
void bind_scene(py::module_ &m)
{
    m.def("scene", scene, "body"_a, "momentum"_a, "attitude"_a, "gravity"_a, "damping"_a);
}
