// The closed form. A plan goes to Python as the doubles that it is made of. Floor 5.
#include "arrays.hpp"

template <class Plan> static py::tuple planned(kr_status status, const Plan &plan)
{
    static_assert(sizeof(Plan) % sizeof(double) == 0, "plain doubles");
    return py::make_tuple(name_of(status), array_of(plan));
}
static py::tuple exact_plan(const doubles &scene)
{
    const auto s = value_of<kr_scene>(scene);
    kr_exact plan = {};
    return planned(kr_exact_plan(&s, &plan), plan);
}
static doubles exact_states(const doubles &plan, const doubles &t)
{
    const auto p = value_of<kr_exact>(plan);
    doubles out({t.size(), py::ssize_t(8)});
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    const double *times = t.data();
    in_pieces(t.size(), [&](py::ssize_t i, py::ssize_t end) { kr_exact_states(&p, size_t(end - i), times + i, states + i); });
    return out;
}
static py::tuple exact_map_plan(const doubles &scene, double step)
{
    const auto s = value_of<kr_scene>(scene);
    kr_exact_map map = {};
    return planned(kr_exact_map_plan(&s, step, &map), map);
}
static doubles exact_map_states(const doubles &plan, const py::array_t<int64_t, py::array::c_style> &k)
{
    const auto map = value_of<kr_exact_map>(plan);
    const py::ssize_t n = k.size();
    doubles out({n, py::ssize_t(8)});
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    const int64_t *numbers = k.data();
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) states[i] = kr_exact_map_state(&map, numbers[i]);
    });
    return out;
}

void bind_exact(py::module_ &m);
void bind_exact(py::module_ &m)
{
    m.def("exact_plan", exact_plan, "scene"_a);
    m.def("exact_states", exact_states, "plan"_a, "t"_a);
    m.def("exact_map_plan", exact_map_plan, "scene"_a, "step"_a);
    m.def("exact_map_states", exact_map_states, "plan"_a, "k"_a);
}
