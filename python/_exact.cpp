// The closed form. A plan goes to Python as the doubles that it is made of.
#include <algorithm>
#include <vector>
#include "times.hpp"

template <class Plan>
static py::tuple planned(kr_status status, const Plan &plan, const kr_exact &curve)
{
    static_assert(sizeof(Plan) % sizeof(double) == 0, "plain doubles");
    return py::make_tuple(name_of(status), curve.period, curve.precession, curve.spin,
                          array_of(plan));
}
static py::tuple exact_plan(const kr_scene &scene)
{
    kr_exact plan = {};
    const kr_status status = kr_exact_plan(&scene, &plan);
    return planned(status, plan, plan);
}
// None where a time is not below `most`, or the times are not plainly numbers: Python has to look.
static py::object exact_states(const doubles &plan, const py::object &t, double most)
{
    const auto p = value_of<kr_exact>(plan);
    given_times times;
    if (!times.take(t) || !times.are_below(most)) return py::none();
    const py::ssize_t n = py::ssize_t(times.size());
    doubles out({n, py::ssize_t(8)});
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    if (n == 1)
        *states = kr_exact_state(&p, *times.data());
    else
        in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
            kr_exact_states(&p, size_t(end - i), times.data() + i, states + i);
        });
    return std::move(out);
}
// One plan a scene, as rows; and how many there are before the first scene without one, whose
// status it is.
static py::tuple exact_plans(const py::list &blocks)
{
    std::vector<kr_scene> scenes;
    scenes.reserve(blocks.size());
    for (const auto &block : blocks) scenes.push_back(py::cast<kr_scene>(block));
    doubles out({py::ssize_t(scenes.size()), py::ssize_t(sizeof(kr_exact) / sizeof(double))});
    auto *plans = reinterpret_cast<kr_exact *>(out.mutable_data());
    kr_status status = KR_OK;
    py::ssize_t done = 0;
    in_pieces(py::ssize_t(scenes.size()), [&](py::ssize_t, py::ssize_t end) {
        while (done < end && status == KR_OK &&
               (status = kr_exact_plan(&scenes[size_t(done)], plans + done)) == KR_OK)
            done++;
    });
    return py::make_tuple(name_of(status), done, out);
}
// (plans, times, 8)
static doubles exact_plans_states(const doubles &plans, const doubles &t)
{
    const auto n = plans.shape(0);
    const auto times = t.size();
    doubles out({n, times, py::ssize_t(8)});
    const auto *from = reinterpret_cast<const kr_exact *>(plans.data());
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    const double *at = t.data();
    in_pieces(n * times, [&](py::ssize_t i, py::ssize_t end) {
        while (i < end) {
            const py::ssize_t begin = i % times, count = std::min(end - i, times - begin);
            if (count == 1)
                states[i] = kr_exact_state(from + i / times, at[begin]);
            else
                kr_exact_states(from + i / times, size_t(count), at + begin, states + i);
            i += count;
        }
    });
    return out;
}
// A row a scene, of what a kr_turning holds beside its course; the courses; and how many scenes
// there are before the first without turning points, whose status it is.
static py::tuple exact_turnings(const py::list &blocks)
{
    std::vector<kr_scene> scenes;
    scenes.reserve(blocks.size());
    for (const auto &block : blocks) scenes.push_back(py::cast<kr_scene>(block));
    doubles out({py::ssize_t(scenes.size()), py::ssize_t(10)});
    double *rows = out.mutable_data();
    std::vector<const char *> courses(scenes.size());
    kr_status status = KR_OK;
    py::ssize_t done = 0;
    in_pieces(py::ssize_t(scenes.size()), [&](py::ssize_t, py::ssize_t end) {
        for (kr_turning r; done < end && status == KR_OK; done += status == KR_OK) {
            status = kr_exact_turning(&scenes[size_t(done)], &r);
            if (status != KR_OK) continue;
            const double row[] = {r.least, r.greatest,   r.t_least, r.t_greatest,   r.critical_spin,
                                  r.sum,   r.difference, r.inertia, r.axial_energy, r.lever};
            std::copy(std::begin(row), std::end(row), rows + 10 * done);
            courses[size_t(done)] = r.course;
        }
    });
    py::list names;
    for (py::ssize_t i = 0; i < done; i++) names.append(courses[size_t(i)]);
    return py::make_tuple(name_of(status), done, out, names);
}
// The potential at each nutation, by a row of exact_turnings.
static doubles turning_potential(const doubles &row, const doubles &nutation)
{
    const double *r = row.data();
    kr_turning turning = {};
    turning.sum = r[5];
    turning.difference = r[6];
    turning.inertia = r[7];
    turning.axial_energy = r[8];
    turning.lever = r[9];
    doubles out(nutation.size());
    double *to = out.mutable_data();
    for (py::ssize_t i = 0; i < nutation.size(); i++)
        to[i] = kr_turning_potential(&turning, nutation.data()[i]);
    return out;
}
static py::tuple exact_map_plan(const kr_scene &scene, double step)
{
    kr_exact_map map = {};
    const kr_status status = kr_exact_map_plan(&scene, step, &map);
    return planned(status, map, map.curve);
}
static doubles exact_map_states(const doubles &plan,
                                const py::array_t<int64_t, py::array::c_style> &k)
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
    m.def("exact_states", exact_states, "plan"_a, "t"_a, "most"_a);
    m.def("exact_plans", exact_plans, "scenes"_a);
    m.def("exact_plans_states", exact_plans_states, "plans"_a, "t"_a);
    m.def("exact_turnings", exact_turnings, "scenes"_a);
    m.def("turning_potential", turning_potential, "row"_a, "nutation"_a);
    m.def("exact_map_plan", exact_map_plan, "scene"_a, "step"_a);
    m.def("exact_map_states", exact_map_states, "plan"_a, "k"_a);
}
