// The module of the binding. It contains no numerics, and no messages except those for arrays of
// the wrong shape. Tables of the core
// become Python tables. States are an (n, 8) array that is shared, not copied; bodies and scenes
// are blocks of bytes.
#include <string>
#include <vector>
#include "paths.hpp"
// All files are one unit, because the headers of pybind11 take most of the time to compile.
#include "_alone.cpp"
#include "_events.cpp"
#include "_exact.cpp"
#include "_run.cpp"
#include "_scene.cpp"
#include "_tops.cpp"
#include "_worker.cpp"

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

// Returns an array with the results of a function at n states of a scene, each result of the shape
// `shape`.
template <class Function>
static doubles each(const doubles &states, std::vector<py::ssize_t> shape, Function function)
{
    const kr_state *in = states_of(states);
    const py::ssize_t n = states.shape(0);
    shape.insert(shape.begin(), n);
    doubles out(shape);
    double *to = out.mutable_data();
    const py::ssize_t width = n > 0 ? out.size() / n : 0;
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        function(size_t(end - i), in + i, to + width * i);
    });
    return out;
}
static doubles values(const std::string &name, const kr_scene &scene, const doubles &states)
{
    const kr_quantity *quantity = kr_quantity_find(name.c_str());
    if (!quantity) throw py::key_error(name);
    return each(states, shape_of(quantity), [&](size_t n, const kr_state *in, double *out) {
        kr_quantity_values(quantity, &scene, n, in, out);
    });
}
// Returns the derivatives of a quantity at n states, from the tangents (n, 6, columns) there by the
// parameters `by`: an array (n, ..., columns). Those of q are rotation vectors.
static doubles derivatives(const std::string &name, const kr_scene &scene, const doubles &states,
                           uint64_t by, const doubles &tangents)
{
    const kr_quantity *quantity = kr_quantity_find(name.c_str());
    if (!quantity) throw py::key_error(name);
    const size_t columns = kr_tangent_columns(by);
    auto shape = name == "q" ? std::vector<py::ssize_t>{3} : shape_of(quantity);
    if (size_t(tangents.size()) != size_t(rows(states, 8)) * 6 * columns)
        throw py::value_error("an array has the wrong shape");
    shape.push_back(py::ssize_t(columns));
    const double *from = tangents.data();
    const kr_state *first = states_of(states);
    return each(states, shape, [&](size_t n, const kr_state *in, double *out) {
        kr_quantity_tangents(quantity, &scene, n, in, by, from + size_t(in - first) * 6 * columns,
                             out);
    });
}
template <int order>
static doubles modified_energy(const kr_scene &scene, const doubles &states, double step)
{
    return each(states, {}, [&](size_t n, const kr_state *in, double *out) {
        for (size_t i = 0; i < n; i++)
            out[i] = kr_state_modified_energy(&scene, &in[i], step, order);
    });
}
static doubles attitude_error(const doubles &a, const doubles &b)
{
    const py::ssize_t n = rows(a, 4);
    if (rows(b, 4) != n) throw py::value_error("an array has the wrong shape");
    doubles out(n);
    double *to = out.mutable_data();
    auto *p = reinterpret_cast<const kr_quat *>(a.data()),
         *q = reinterpret_cast<const kr_quat *>(b.data());
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) to[i] = kr_attitude_error(p[i], q[i]);
    });
    return out;
}

// Returns the name of the status, the body, and whether it is physical.
static const char *body_kind(const kr_body &body, double rtol)
{
    return kr_kind_name(kr_body_kind(&body, rtol));
}

static const char *scene_kind(const kr_scene &scene) { return kr_kind_name(kind_of(scene)); }

static py::dict status_table()
{
    py::dict table;
    for (const auto &s : statuses) table[s.name] = py::make_tuple(s.what, s.text);
    return table;
}
static py::list kind_names()
{
    py::list names;
    for (int kind = 0; kind < KR_KIND_COUNT; kind++) names.append(kr_kind_name(kr_kind(kind)));
    return names;
}
static py::dict tangent_table()
{
    py::dict table;
#define X(by, bit, columns, name) table[name] = py::make_tuple(bit, columns);
    KR_TANGENT_LIST(X)
#undef X
    return table;
}
static py::dict flag_table()
{
    py::dict table;
#define X(flag, bit, name, text) table[name] = bit;
    KR_FLAG_LIST(X)
#undef X
    return table;
}
static py::list method_table()
{
    py::list table;
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method_info m = kr_method_describe(kr_method_at(i));
        table.append(py::dict("name"_a = m.name, "text"_a = m.text, "order"_a = m.order,
                              "conserves"_a = m.conserves, "reference"_a = m.reference,
                              "flags"_a = m.flags));
    }
    return table;
}
static py::list quantity_table()
{
    py::list table;
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *q = kr_quantity_at(i);
        const unsigned flags = q->flags;
        py::list components;
        for (size_t k = 0; k < q->doubles; k++)
            components.append(std::string(q->name) + q->suffixes[k]);
        table.append(py::dict("name"_a = q->name, "doubles"_a = q->doubles,
                              "turns"_a = (flags & KR_QUANTITY_TURNS) != 0,
                              "kept"_a = (flags & KR_QUANTITY_CONSERVED) != 0,
                              "in_events"_a = (flags & KR_QUANTITY_IN_EVENTS) != 0,
                              "dimension"_a = q->dimension, "text"_a = q->text,
                              "components"_a = components));
    }
    return table;
}
static bool method_applies(const std::string &method, const kr_body &body)
{
    return kr_method_applies(method_of(method), &body) != 0;
}

static bool method_suits(const std::string &method, const kr_scene &scene)
{
    return kr_method_suits(method_of(method), &scene) != 0;
}

PYBIND11_MODULE(_core, m, py::mod_gil_not_used())
{
    bind_alone(m);
    bind_events(m);
    bind_exact(m);
    bind_run(m);
    bind_scene(m);
    bind_tops(m);
    bind_worker(m);
    m.attr("version") = kr_version();
    m.attr("statuses") = status_table();
    m.attr("methods") = method_table();
    m.attr("quantities") = quantity_table();
    m.attr("kinds") = kind_names();
    m.attr("flags") = flag_table();
    m.attr("tangents") = tangent_table();
    m.attr("KIND_RTOL") = KR_KIND_RTOL;
    m.attr("TENSOR_LEAST") = KR_TENSOR_MIN_RATIO;
    m.attr("INPUT_RTOL") = KR_INPUT_RTOL;
    m.def("method_applies", method_applies, "method"_a, "body"_a);
    m.def("method_suits", method_suits, "method"_a, "scene"_a);
    m.def("body_kind", body_kind, "body"_a, "rtol"_a);
    m.def("scene_kind", scene_kind, "scene"_a);
    m.def("values", values, "name"_a, "scene"_a, "states"_a);
    m.def("derivatives", derivatives, "name"_a, "scene"_a, "states"_a, "by"_a, "tangents"_a);
    m.def("modified_energy", modified_energy<1>, "scene"_a, "states"_a, "step"_a);
    m.def("modified_energy4", modified_energy<4>, "scene"_a, "states"_a, "step"_a);
    m.def("attitude_error", attitude_error, "a"_a, "b"_a);
}
