// Thin: one Python name per C function; no numerics, no defaults, no messages.
// A body is 11 doubles, a scene 20, a state 8, as in kreisel.h; states are an (n, 8) array, shared and not copied.
#include <string>
#include <vector>
#include "arrays.hpp"

static py::ssize_t rows(const doubles &a, py::ssize_t width)
{
    if (a.ndim() != 2 || a.shape(1) != width) throw py::value_error("an array has the wrong shape");
    return a.shape(0);
}
static const kr_state *states_of(const doubles &a)
{
    rows(a, 8);
    return reinterpret_cast<const kr_state *>(a.data());
}

// A quantity of each state: `shape` is its own shape, T the doubles that it is made of.
template <class T, class Function>
static doubles each(const doubles &scene, const doubles &states, std::vector<py::ssize_t> shape, Function function)
{
    const auto s = value_of<kr_scene>(scene);
    const kr_state *in = states_of(states);
    const py::ssize_t n = states.shape(0);
    shape.insert(shape.begin(), n);
    doubles out(shape);
    T *to = reinterpret_cast<T *>(out.mutable_data());
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) function(&s, &in[i], &to[i]);
    });
    return out;
}
template <double function(const kr_scene *, const kr_state *)>
static doubles scalar(const doubles &scene, const doubles &states)
{
    return each<double>(scene, states, {}, [](auto *s, auto *state, double *to) { *to = function(s, state); });
}
template <kr_vec3 function(const kr_scene *, const kr_state *)>
static doubles vector(const doubles &scene, const doubles &states)
{
    return each<kr_vec3>(scene, states, {3}, [](auto *s, auto *state, kr_vec3 *to) { *to = function(s, state); });
}
static doubles frame(const doubles &scene, const doubles &states)
{
    struct axes { kr_vec3 unit[3]; };
    return each<axes>(scene, states, {3, 3}, [](auto *s, auto *state, axes *to) { kr_state_frame(s, state, to->unit); });
}
template <double function(const kr_scene *, const kr_state *, double)>
static doubles at_step(const doubles &scene, const doubles &states, double step)
{
    return each<double>(scene, states, {}, [step](auto *s, auto *state, double *to) { *to = function(s, state, step); });
}
static doubles attitude_error(const doubles &a, const doubles &b)
{
    const py::ssize_t n = rows(a, 4);
    if (rows(b, 4) != n) throw py::value_error("an array has the wrong shape");
    doubles out(n);
    double *to = out.mutable_data();
    auto *p = reinterpret_cast<const kr_quat *>(a.data()), *q = reinterpret_cast<const kr_quat *>(b.data());
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) to[i] = kr_attitude_error(p[i], q[i]);
    });
    return out;
}

// Bodies and scenes: the name of the status, and what was made.
static py::tuple body_from_tensor(double mass, const doubles &inertia, const doubles &com)
{
    kr_body body = {};
    if (inertia.size() != 9) throw py::value_error("an array has the wrong shape");
    const kr_status status = kr_body_from_tensor(mass, inertia.data(), value_of<kr_vec3>(com), &body);
    return py::make_tuple(name_of(status), array_of(body));
}
static const char *body_kind(const doubles &body, double rtol)
{
    static const char *const names[] = {"general", "euler", "lagrange", "kowalewski", "goryachev_chaplygin"};
    const auto b = value_of<kr_body>(body);
    return names[kr_body_kind(&b, rtol)];
}
static const char *scene_check(const doubles &scene)
{
    const auto s = value_of<kr_scene>(scene);
    return name_of(kr_scene_check(&s));
}

static py::dict status_table()
{
    py::dict table;
    for (const auto &s : statuses) table[s.name] = py::make_tuple(s.what, s.text);
    return table;
}
static py::list method_table()
{
    py::list table;
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *m = kr_method_at(i);
        table.append(py::dict("name"_a = kr_method_name(m), "text"_a = kr_method_text(m), "order"_a = kr_method_order(m),
                              "conserves"_a = kr_method_conserves(m), "reference"_a = kr_method_reference(m),
                              "flags"_a = kr_method_flags(m)));
    }
    return table;
}
static bool method_applies(const std::string &method, const doubles &body)
{
    const auto b = value_of<kr_body>(body);
    return kr_method_applies(method_of(method), &b) != 0;
}

static bool method_suits(const std::string &method, const doubles &scene)
{
    const auto s = value_of<kr_scene>(scene);
    return kr_method_suits(method_of(method), &s) != 0;
}

void bind_events(py::module_ &m);       // _events.cpp
void bind_exact(py::module_ &m);        // _exact.cpp
void bind_run(py::module_ &m);          // _run.cpp

PYBIND11_MODULE(_core, m, py::mod_gil_not_used())
{
    bind_events(m);
    bind_exact(m);
    bind_run(m);
    m.attr("version") = kr_version();
    m.attr("statuses") = status_table();
    m.attr("methods") = method_table();
    m.attr("KIND_RTOL") = KR_KIND_RTOL;
    m.attr("SYMPLECTIC") = int(KR_SYMPLECTIC);
    m.attr("REVERSIBLE") = int(KR_REVERSIBLE);
    m.attr("ADAPTIVE") = int(KR_ADAPTIVE);
    m.attr("IMPLICIT") = int(KR_IMPLICIT);
    m.attr("ALGEBRAIC") = int(KR_ALGEBRAIC);
    m.attr("INTEGRABLE") = int(KR_INTEGRABLE);
    m.attr("LAGRANGE_ONLY") = int(KR_LAGRANGE_ONLY);
    m.attr("SYMMETRIC_ONLY") = int(KR_SYMMETRIC_ONLY);
    m.attr("EULER_ONLY") = int(KR_EULER_ONLY);
    m.attr("DIGITS") = int(KR_DIGITS);
    m.attr("HEADLESS") = int(KR_HEADLESS);
    m.def("method_applies", method_applies, "method"_a, "body"_a);
    m.def("method_suits", method_suits, "method"_a, "scene"_a);
    m.def("body_from_tensor", body_from_tensor, "mass"_a, "inertia"_a, "com"_a);
    m.def("body_kind", body_kind, "body"_a, "rtol"_a);
    m.def("scene_check", scene_check, "scene"_a);
    m.def("velocity", vector<kr_state_velocity>, "scene"_a, "states"_a);
    m.def("torque", vector<kr_state_torque>, "scene"_a, "states"_a);
    m.def("apex", vector<kr_state_apex>, "scene"_a, "states"_a);
    m.def("frame", frame, "scene"_a, "states"_a);
    m.def("nutation", scalar<kr_state_nutation>, "scene"_a, "states"_a);
    m.def("kinetic", scalar<kr_state_kinetic>, "scene"_a, "states"_a);
    m.def("potential", scalar<kr_state_potential>, "scene"_a, "states"_a);
    m.def("vertical", scalar<kr_state_vertical>, "scene"_a, "states"_a);
    m.def("axial", scalar<kr_state_axial>, "scene"_a, "states"_a);
    m.def("kowalewski", scalar<kr_state_kowalewski>, "scene"_a, "states"_a);
    m.def("goryachev_chaplygin", scalar<kr_state_goryachev_chaplygin>, "scene"_a, "states"_a);
    m.def("modified_energy", at_step<kr_state_modified_energy>, "scene"_a, "states"_a, "step"_a);
    m.def("modified_energy4", at_step<kr_state_modified_energy4>, "scene"_a, "states"_a, "step"_a);
    m.def("attitude_error", attitude_error, "a"_a, "b"_a);
}
