// Thin: one Python name per C function; no numerics, no defaults, no messages. Floor 5.
// A body is 11 doubles, a scene 20, a state 8, as in kreisel.h; states are an (n, 8) array, shared and not copied.
#include <chrono>
#include <memory>
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
    static_assert(sizeof(kr_state) == 8 * sizeof(double) && sizeof(kr_scene) == 20 * sizeof(double), "plain doubles");
    rows(a, 8);
    return reinterpret_cast<const kr_state *>(a.data());
}
static const kr_method *method_of(const std::string &name)
{
    const kr_method *method = kr_method_find(name.c_str());
    if (!method) throw py::key_error(name);
    return method;
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
    py::gil_scoped_release nogil;
    for (py::ssize_t i = 0; i < n; i++) function(&s, &in[i], &to[i]);
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
    py::gil_scoped_release nogil;
    for (py::ssize_t i = 0; i < n; i++) to[i] = kr_attitude_error(p[i], q[i]);
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

// Ctrl-C. Only the main thread may run Python's signal handlers, and taking the GIL is not free: hence the clock.
struct signals {
    using clock = std::chrono::steady_clock;
    clock::time_point last = clock::now();
    std::unique_ptr<py::error_already_set> raised;

    static int poll(void *context)
    {
        auto *self = static_cast<signals *>(context);
        const auto now = clock::now();
        if (now - self->last < std::chrono::milliseconds(10)) return 0;
        self->last = now;
        py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() == 0) return 0;
        self->raised = std::make_unique<py::error_already_set>();
        return 1;
    }
};
static bool in_main_thread()
{
    static const py::handle main_thread = py::object(py::module_::import("threading").attr("main_thread")).release();
    return main_thread().attr("ident").cast<unsigned long>() == PyThread_get_thread_ident();
}

// The states written, and the last good one where that is later; `out` or what it leaves out.
static doubles reached(doubles out, size_t done, bool more, const kr_state &last)
{
    const kr_state *written = states_of(out);
    doubles part({py::ssize_t(done + more), py::ssize_t(8)});
    std::memcpy(part.mutable_data(), written, done * sizeof(kr_state));
    if (more) std::memcpy(part.mutable_data(py::ssize_t(done), 0), &last, sizeof last);
    return part;
}
static py::tuple record(const doubles &scene, const std::string &method, double step, double tol, int digits,
                        int64_t max_steps, const doubles &t)
{
    const auto s = value_of<kr_scene>(scene);
    const size_t n = size_t(t.size());
    doubles out({t.size(), py::ssize_t(8)}), low({digits > 16 ? t.size() : py::ssize_t(0), py::ssize_t(8)});
    const double *times = t.data();
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    auto *rest = digits > 16 ? reinterpret_cast<kr_state *>(low.mutable_data()) : nullptr;
    signals pending;
    kr_config config = {step, tol, max_steps, in_main_thread() ? signals::poll : nullptr, &pending, digits, 0};
    kr_top *raw = nullptr;
    size_t done = 0;
    kr_status status = kr_top_create(&s, method_of(method), config, &raw);
    if (status != KR_OK) {
        const py::tuple nothing = py::make_tuple(0, 0, 0, 0);
        return py::make_tuple(name_of(status), reached(out, 0, true, s.start), py::none(), nothing);
    }
    const std::unique_ptr<kr_top, void (*)(kr_top *)> top(raw, kr_top_free);
    {
        py::gil_scoped_release nogil;
        status = kr_top_record_low(raw, n, times, states, rest, &done);
    }
    if (pending.raised && !pending.raised->matches(PyExc_KeyboardInterrupt)) throw *pending.raised;
    if (status != KR_OK) {
        const kr_state last = kr_top_state(raw);
        const bool more = done == 0 || states[done - 1].t != last.t;
        out = reached(out, done, more, last);
        if (rest) low = reached(low, done, more, kr_top_low(raw));
    }
    const kr_stats stats = kr_top_stats(raw);
    const py::tuple counts = py::make_tuple(stats.steps, stats.rejected, stats.evaluations, stats.iterations);
    return py::make_tuple(name_of(status), out, rest ? py::object(low) : py::none(), counts);
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

void bind_exact(py::module_ &m);        // _exact.cpp

PYBIND11_MODULE(_core, m, py::mod_gil_not_used())
{
    bind_exact(m);
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
    m.def("method_applies", method_applies, "method"_a, "body"_a);
    m.def("method_suits", method_suits, "method"_a, "scene"_a);
    m.def("body_from_tensor", body_from_tensor, "mass"_a, "inertia"_a, "com"_a);
    m.def("body_kind", body_kind, "body"_a, "rtol"_a);
    m.def("scene_check", scene_check, "scene"_a);
    m.def("record", record, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a, "t"_a);
    m.def("velocity", vector<kr_state_velocity>, "scene"_a, "states"_a);
    m.def("torque", vector<kr_state_torque>, "scene"_a, "states"_a);
    m.def("apex", vector<kr_state_apex>, "scene"_a, "states"_a);
    m.def("frame", frame, "scene"_a, "states"_a);
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
