// Scenes: one call checks and stores the arguments.
#include <array>
#include <pybind11/stl.h>
#include "times.hpp"
#include "tops.hpp"

// The rounding of Python's math.radians.
static const double radians_per_degree = 3.14159265358979323846 / 180.0;
static bool v_is_zero(const kr_vec3 &v) { return v.x == 0.0 && v.y == 0.0 && v.z == 0.0; }
// Returns a vector as Python stores it. Vectors that were not given share one tuple of zeros.
static py::object vector_of(const py::object &given, const kr_vec3 &v)
{
    static const py::tuple &zeros = *new py::tuple(py::make_tuple(0.0, 0.0, 0.0));
    return given.is_none() ? zeros : py::make_tuple(v.x, v.y, v.z);
}
static kr_vec3 vector(const double (&v)[3]) { return {v[0], v[1], v[2]}; }
static py::tuple tuple_of(const kr_vec3 &v) { return py::make_tuple(v.x, v.y, v.z); }

// Reads three moments, three rows, or an array of 3 x 3 doubles. Returns false for anything else.
static bool read_tensor(const py::object &inertia, double (&j)[9])
{
    double row[3];
    if (numbers_of(inertia, row)) {
        for (int i = 0; i < 9; i++) j[i] = i % 4 == 0 ? row[i / 4] : 0.0;
        return true;
    }
    if (PyTuple_CheckExact(inertia.ptr()) && PyTuple_GET_SIZE(inertia.ptr()) == 3) {
        for (int i = 0; i < 3; i++) {
            if (!numbers_of(PyTuple_GET_ITEM(inertia.ptr(), i), row)) return false;
            std::memcpy(j + 3 * i, row, sizeof row);
        }
        return true;
    }
    const auto *array_type = py::detail::npy_api::get().PyArray_Type_;
    if (Py_TYPE(inertia.ptr()) != array_type || !py::isinstance<doubles>(inertia)) return false;
    const auto array = py::reinterpret_borrow<doubles>(inertia);
    if (array.ndim() != 2 || array.shape(0) != 3 || array.shape(1) != 3) return false;
    std::memcpy(j, array.data(), sizeof j);
    return true;
}
// Returns the numbers of a body as Python stores them, its block, and whether some distribution of
// mass has them: mass, inertia, com, inertia_rtol, rotor, moments, principal_com, axes,
// principal_rotor, block, is_physical. Returns None if Python has to examine the arguments.
static py::object body(const py::object &mass, const py::object &inertia, const py::object &com,
                       const py::object &inertia_rtol, const py::object &rotor, bool at_com)
{
    double m, j[9], c[3], rtol, h[3];
    if (!plain_number(mass.ptr(), m) || !read_tensor(inertia, j) || !numbers_of(com, c) ||
        !plain_number(inertia_rtol.ptr(), rtol) || !numbers_of(rotor, h))
        return py::none();
    if (at_com) kr_inertia_add_point(j, m, vector(c));
    kr_body b = {};
    if (kr_body_from_tensor(m, j, vector(c), rtol, &b) != KR_OK) return py::none();
    for (double &x : h) {
        if (!std::isfinite(x)) return py::none();
        x += 0.0; // no negative zeros
    }
    kr_body_set_rotor(&b, vector(h));
    bool is_diagonal = true;
    for (int i = 0; i < 9; i++) is_diagonal = is_diagonal && (i % 4 == 0 || j[i] == 0.0);
    const py::tuple moments = py::make_tuple(j[0], j[4], j[8]);
    const kr_quat q = b.axes;
    return py::make_tuple(m,
                          is_diagonal ? moments
                                      : py::make_tuple(py::make_tuple(j[0], j[1], j[2]),
                                                       py::make_tuple(j[3], j[4], j[5]),
                                                       py::make_tuple(j[6], j[7], j[8])),
                          tuple_of(vector(c)), rtol, tuple_of(vector(h)), tuple_of(b.inertia),
                          tuple_of(b.com), py::make_tuple(q.w, q.x, q.y, q.z), tuple_of(b.rotor),
                          block_of(b), kr_body_is_physical(&b) != 0);
}

// The arguments of every constructor of scenes.
struct environment {
    py::object gravity, damping, turning, shaking, friction, gradient;

    explicit environment(const py::tuple &given)
        : gravity(given[0]), damping(given[1]), turning(given[2]), shaking(given[3]),
          friction(given[4]), gradient(given[5])
    {
    }
    // Writes the environment. Returns false if an argument does not consist of plain numbers.
    bool fill(kr_scene &s, bool in_degrees) const
    {
        double d[3] = {}, u[3] = {}, k[3] = {};
        const bool is_weightless = gravity.is_none() && v_is_zero(s.body.com);
        if (!is_weightless && !plain_number(gravity.ptr(), s.gravity)) return false;
        if (plain_number(damping.ptr(), d[0]))
            d[1] = d[2] = d[0];
        else if (!damping.is_none() && !numbers_of(damping, d))
            return false;
        if (!turning.is_none() && !numbers_of(turning, u)) return false;
        if (!shaking.is_none() && !numbers_of(shaking, k)) return false;
        if (!friction.is_none() && !plain_number(friction.ptr(), s.friction)) return false;
        if (!gradient.is_none() && !plain_number(gradient.ptr(), s.gradient)) return false;
        const double unit = in_degrees ? radians_per_degree : 1.0;
        s.damping = {d[0], d[1], d[2]};
        s.turning = {u[0] * unit, u[1] * unit, u[2] * unit};
        s.shaking = {k[0], k[1] * unit, k[2] * unit};
        return true;
    }
    bool has_disturbance(const kr_scene &s) const
    {
        return !v_is_zero(s.damping) || !v_is_zero(s.turning) || s.friction != 0.0 ||
               s.gradient != 0.0 || s.shaking.amplitude != 0.0 || s.shaking.rate != 0.0 ||
               s.shaking.phase != 0.0;
    }
    // Returns the numbers of a scene as Python stores them, and its block: momentum, attitude,
    // gravity, damping, turning, shaking, friction, gradient, block. Returns None if the scene is invalid.
    py::object numbers(const kr_scene &s) const
    {
        if (kr_scene_check(&s) != KR_OK) return py::none();
        const kr_quat q = s.start.q;
        const kr_shaking k = s.shaking;
        return py::make_tuple(tuple_of(s.start.m), py::make_tuple(q.w, q.x, q.y, q.z), s.gravity,
                              vector_of(damping, s.damping), vector_of(turning, s.turning),
                              vector_of(shaking, {k.amplitude, k.rate, k.phase}), s.friction,
                              s.gradient, block_of(s));
    }
};
// The constructors return the numbers of a scene, or None if Python has to examine the arguments.
// `starts` are momentum, velocity, body_momentum and body_velocity.
static py::object scene(const kr_body &body, const py::tuple &starts, const py::object &attitude,
                        const py::tuple &around)
{
    const environment given(around);
    double v[3], q[4] = {1.0, 0.0, 0.0, 0.0};
    size_t kind = starts.size();
    for (size_t i = 0; i < starts.size(); i++) {
        if (starts[i].is_none()) continue;
        if (kind < starts.size() || !numbers_of(starts[i], v)) return py::none();
        kind = i;
    }
    kr_scene s = {};
    s.body = body;
    if (kind == starts.size() || !given.fill(s, false)) return py::none();
    if (!attitude.is_none() && !numbers_of(attitude, q)) return py::none();
    s.start.q = {q[0], q[1], q[2], q[3]};
    set_start[kind](&s, vector(v));
    return given.numbers(s);
}
static py::object euler(const kr_body &body, const py::object &angles, const py::object &rates,
                        bool in_degrees, const py::tuple &around)
{
    const environment given(around);
    double a[3], r[3];
    kr_scene s = {};
    s.body = body;
    if (!numbers_of(angles, a) || !numbers_of(rates, r) || !given.fill(s, in_degrees))
        return py::none();
    for (int i = 0; i < 3 && in_degrees; i++)
        a[i] *= radians_per_degree, r[i] *= radians_per_degree;
    kr_scene_set_euler(&s, vector(a), vector(r));
    return given.numbers(s);
}
static py::object spinning(const kr_body &body, const py::object &spin, const py::object &tilt,
                           const py::object &precession, bool is_steady, bool is_fast,
                           bool in_degrees, const py::tuple &around)
{
    const environment given(around);
    double rate, angle, about = 0.0, least;
    kr_scene s = {};
    s.body = body;
    if (!plain_number(spin.ptr(), rate) || !plain_number(tilt.ptr(), angle) ||
        !given.fill(s, in_degrees) || (is_fast && !is_steady))
        return py::none();
    if (!precession.is_none() && (is_steady || !plain_number(precession.ptr(), about)))
        return py::none();
    if (in_degrees)
        rate *= radians_per_degree, angle *= radians_per_degree, about *= radians_per_degree;
    if (is_steady &&
        (given.has_disturbance(s) || !v_is_zero(body.rotor) ||
         kr_scene_steady_precession(&s, rate, angle, is_fast, &about, &least) != KR_OK))
        return py::none();
    return kr_scene_set_spinning(&s, rate, angle, about) == KR_OK ? given.numbers(s) : py::none();
}

void bind_scene(py::module_ &m);
void bind_scene(py::module_ &m)
{
    m.def("scene_horizon", [](const kr_scene &s) { return kr_scene_horizon(&s); }, "scene"_a);
    m.def(
        "body_symmetry",
        [](const kr_body &b) -> py::object {
            double across, along;
            if (!kr_body_symmetry(&b, &across, &along)) return py::none();
            return py::make_tuple(across, along);
        },
        "body"_a);
    m.def("body", body, "mass"_a, "inertia"_a, "com"_a, "inertia_rtol"_a, "rotor"_a, "at_com"_a);
    m.def("scene", scene, "body"_a, "starts"_a, "attitude"_a, "around"_a);
    m.def("euler", euler, "body"_a, "angles"_a, "rates"_a, "in_degrees"_a, "around"_a);
    m.def("spinning", spinning, "body"_a, "spin"_a, "tilt"_a, "precession"_a, "is_steady"_a,
          "is_fast"_a, "in_degrees"_a, "around"_a);
}
