// Closed forms. Python stores a plan as an array of its doubles, or as a TorusPlan if the motion is
// on a torus.
#include <algorithm>
#include <memory>
#include <vector>
#include "results.hpp"
#include "times.hpp"

// Returns the name of the status, the period, the mean rates and all doubles of a kr_exact or a
// kr_exact_map.
template <class Plan> static py::tuple planned(kr_status status, const Plan &plan)
{
    static_assert(sizeof(Plan) % sizeof(double) == 0, "plain doubles");
    return py::make_tuple(name_of(status), plan.period, plan.precession_rate, plan.spin_angle_rate,
                          array_of(plan));
}
static py::tuple exact_plan(const kr_scene &scene)
{
    kr_exact plan = {};
    const kr_status status = kr_exact_plan(&scene, &plan);
    return planned(status, plan);
}
// Returns the states of a plan at the times t. Returns None if a time is not below `most`, or if
// the times need validation by Python.
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
// The numbers at the head of a plan of a top whose motion is on a torus, and the text of its
// refusal.
struct torus_head {
    double first, second, precession, certificate;
    const char *refusal;
};
// Such a plan, in memory that Python cannot write. Only the pointer to the plan's own kind is set.
class torus_memory
{
    std::unique_ptr<double[]> doubles;
    size_t size = 0;
    const kr_kowalewski *kowalewski = nullptr;
    const kr_goryachev_chaplygin *chaplygin = nullptr;

    // Moves a plan to memory of the size that it uses.
    template <class Plan> void move(const Plan *&plan)
    {
        const size_t used = plan->used / sizeof(double) + 1;
        std::unique_ptr<double[]> copy(new double[used]);
        std::memcpy(copy.get(), doubles.get(), plan->used);
        doubles = std::move(copy);
        size = used * sizeof(double);
        plan = reinterpret_cast<const Plan *>(doubles.get());
    }
    void *allocate(size_t bytes)
    {
        if (bytes > size) doubles.reset(new double[bytes / sizeof(double) + 1]);
        size = std::max(size, bytes);
        return doubles.get();
    }

  public:
    // Computes the plan of a Goryachev-Chaplygin top or, for all other bodies, of a Kowalewski top.
    kr_status plan(const kr_scene &scene, double bound, torus_head &out)
    {
        kowalewski = nullptr;
        chaplygin = nullptr;
        if (kr_body_kind(&scene.body, KR_KIND_RTOL) == KR_KIND_GORYACHEV_CHAPLYGIN) {
            void *memory = allocate(kr_goryachev_chaplygin_size());
            const kr_status status = kr_goryachev_chaplygin_plan(&scene, bound, memory, &chaplygin);
            kr_goryachev_chaplygin head;
            std::memcpy(&head, memory, sizeof head);
            out = {head.first, head.second, 0.0, head.certificate,
                   kr_goryachev_chaplygin_refusal_text(head.refusal)};
            return status;
        }
        void *memory = allocate(kr_kowalewski_size());
        const kr_status status = kr_kowalewski_plan(&scene, bound, memory, &kowalewski);
        kr_kowalewski head;
        std::memcpy(&head, memory, sizeof head);
        out = {head.first, head.second, 2.0 * head.heading, head.certificate,
               kr_kowalewski_refusal_text(head.refusal)};
        return status;
    }
    // Frees the memory of the set-up. Without a plan, frees all memory.
    void shrink()
    {
        if (kowalewski)
            move(kowalewski);
        else if (chaplygin)
            move(chaplygin);
        else {
            doubles.reset();
            size = 0;
        }
    }
    bool is_planned() const { return kowalewski || chaplygin; }
    void states(size_t n, const double *t, kr_state *out) const
    {
        if (kowalewski)
            kr_kowalewski_states(kowalewski, n, t, out);
        else
            kr_goryachev_chaplygin_states(chaplygin, n, t, out);
    }
    kr_state state_at(const double turns[2]) const
    {
        return kowalewski ? kr_kowalewski_state_at(kowalewski, turns[0], turns[1])
                          : kr_goryachev_chaplygin_state_at(chaplygin, turns[0], turns[1]);
    }
};
static py::tuple torus_plan(const kr_scene &scene, double bound)
{
    auto memory = std::make_unique<torus_memory>();
    torus_head head;
    const kr_status status = memory->plan(scene, bound, head);
    memory->shrink();
    return py::make_tuple(name_of(status), head.refusal,
                          py::make_tuple(head.first, head.second, head.precession),
                          head.certificate, std::move(memory));
}
// Returns the states of a plan at the times t, or None in the same cases as exact_states.
static py::object torus_states(const torus_memory &plan, const py::object &t, double most)
{
    if (!plan.is_planned()) throw py::value_error("there is no plan");
    given_times times;
    if (!times.take(t) || !times.are_below(most)) return py::none();
    const py::ssize_t n = py::ssize_t(times.size());
    doubles out({n, py::ssize_t(8)});
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        plan.states(size_t(end - i), times.data() + i, states + i);
    });
    return std::move(out);
}
// Returns the states of a plan at the two angles in each row of `turns`.
static doubles torus_states_at(const torus_memory &plan, const doubles &turns)
{
    if (!plan.is_planned()) throw py::value_error("there is no plan");
    if (turns.ndim() != 2 || turns.shape(1) != 2) throw py::value_error("each row has two angles");
    const py::ssize_t n = turns.shape(0);
    doubles out({n, py::ssize_t(8)});
    auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
    const double *angles = turns.data();
    in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) states[i] = plan.state_at(angles + 2 * i);
    });
    return out;
}
// Calls use(i - begin, scene) for the tops i from begin to end, until one is refused or the work is
// stopped. Returns the name of the status, and the index of the first top that is not done, or
// `end`.
template <class Use>
static py::tuple each_of(const tops &all, size_t begin, size_t end, std::shared_ptr<work> with,
                         Use use)
{
    kr_status status = KR_OK;
    size_t i = begin;
    patience waiting;
    waiting.shared = std::move(with);
    waiting.begin();
    {
        py::gil_scoped_release nogil;
        kr_scene scene;
        while (i < end && status == KR_OK && !patience::poll(&waiting)) {
            all.fill(i, i + 1, &scene);
            status = use(i - begin, scene);
            i += status == KR_OK;
        }
    }
    waiting.end();
    return py::make_tuple(name_of(status), i);
}
// Writes period, precession and spin, one row for each top; NaN if its motion is on a torus.
static py::tuple exact_rates(const tops &all, size_t begin, size_t end, const py::object &out,
                             const std::shared_ptr<work> &with)
{
    double *to = in_place<double>(out, 3 * (end - begin));
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        kr_exact plan = {};
        plan.period = plan.precession_rate = plan.spin_angle_rate = NAN;
        const kr_status status = has_torus(scene) ? KR_OK : kr_exact_plan(&scene, &plan);
        const double rates[] = {plan.period, plan.precession_rate, plan.spin_angle_rate};
        std::copy(std::begin(rates), std::end(rates), to + 3 * i);
        return status;
    });
}
// Writes the three frequencies and the certificate of each top whose motion is on a torus, and NaN
// for all other tops.
static py::tuple torus_heads(const tops &all, size_t begin, size_t end, const py::object &out,
                             const std::shared_ptr<work> &with)
{
    double *to = in_place<double>(out, 4 * (end - begin));
    torus_memory memory;
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        torus_head head = {NAN, NAN, NAN, NAN, ""};
        const kr_status status = has_torus(scene) ? memory.plan(scene, 0.0, head) : KR_OK;
        const double numbers[] = {head.first, head.second, head.precession, head.certificate};
        std::copy(std::begin(numbers), std::end(numbers), to + 4 * i);
        return status;
    });
}
// Writes states of the shape (tops, times, 8), at times that are common to all tops or given for
// each.
static py::tuple exact_states_of_tops(const tops &all, size_t begin, size_t end,
                                      const py::object &out, const doubles &t,
                                      const std::shared_ptr<work> &with)
{
    const size_t times = size_t(t.shape(t.ndim() - 1)), own = t.ndim() == 2 ? times : 0;
    if (own && size_t(t.shape(0)) != end - begin) throw py::value_error("there are other times");
    auto *to = reinterpret_cast<kr_state *>(in_place<double>(out, 8 * times * (end - begin)));
    const double *from = t.data();
    torus_memory memory;
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        const double *at = from + i * own;
        kr_state *states = to + i * times;
        torus_head head;
        kr_exact plan;
        const bool on_torus = has_torus(scene);
        const kr_status status =
            on_torus ? memory.plan(scene, 0.0, head) : kr_exact_plan(&scene, &plan);
        if (status != KR_OK) return status;
        if (on_torus)
            memory.states(times, at, states);
        else if (times == 1)
            *states = kr_exact_state(&plan, *at);
        else
            kr_exact_states(&plan, times, at, states);
        return KR_OK;
    });
}

static const char *const courses[] = {"resting", "circle",     "sleeping", "hanging",
                                      "steady",  "separatrix", "pendulum", "rosette",
                                      "loops",   "cusps",      "waves"};
// Writes the numbers of a kr_turning to a row, and the index of its type of motion.
static kr_status read_turning(const kr_scene &scene, double *row, int8_t *course)
{
    kr_turning r;
    const kr_status status = kr_exact_turning(&scene, &r);
    if (status != KR_OK) return status;
    const double numbers[] = {r.least, r.greatest, r.t_least, r.t_greatest, r.critical_spin};
    row = std::copy(std::begin(numbers), std::end(numbers), row);
    std::copy(std::begin(r.private_), std::end(r.private_), row);
    *course =
        int8_t(std::find_if(std::begin(courses), std::end(courses),
                            [&](const char *name) { return !std::strcmp(name, r.motion_type); }) -
               std::begin(courses));
    return KR_OK;
}
static py::tuple exact_turning(const kr_scene &scene)
{
    double row[10];
    int8_t course = 0;
    const kr_status status = read_turning(scene, row, &course);
    doubles out(py::ssize_t(10));
    if (status == KR_OK) std::copy(std::begin(row), std::end(row), out.mutable_data());
    return py::make_tuple(name_of(status), out, courses[course]);
}
// Writes the rows of the tops begin to end. Returns the name of the status, and the index of the
// first top without turning points, or `end`.
static py::tuple exact_turnings(const tops &all, size_t begin, size_t end, const py::object &rows,
                                const py::object &numbers, const std::shared_ptr<work> &with)
{
    double *row = in_place<double>(rows, 10 * (end - begin));
    int8_t *course = in_place<int8_t>(numbers, end - begin);
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        return read_turning(scene, row + 10 * i, course + i);
    });
}
// Returns the potential at each nutation, given a row of exact_turnings.
static doubles turning_potential(const doubles &row, const doubles &nutation)
{
    const double *r = row.data();
    kr_turning turning = {};
    std::copy(r + 5, r + 10, turning.private_);
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
    return planned(status, map);
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
    py::class_<torus_memory>(m, "TorusPlan");
    m.def("torus_plan", torus_plan, "scene"_a, "bound"_a);
    m.def("torus_states", torus_states, "plan"_a, "t"_a, "most"_a);
    m.def("torus_states_at", torus_states_at, "plan"_a, "turns"_a);
    py::list names;
    for (const char *course : courses) names.append(course);
    m.attr("courses") = names;
    m.def("exact_rates", exact_rates, "tops"_a, "begin"_a, "end"_a, "out"_a, "work"_a);
    m.def("torus_heads", torus_heads, "tops"_a, "begin"_a, "end"_a, "out"_a, "work"_a);
    m.def("exact_states_of_tops", exact_states_of_tops, "tops"_a, "begin"_a, "end"_a, "out"_a,
          "t"_a, "work"_a);
    m.def("exact_turning", exact_turning, "scene"_a);
    m.def("exact_turnings", exact_turnings, "tops"_a, "begin"_a, "end"_a, "rows"_a, "courses"_a,
          "work"_a);
    m.def("turning_potential", turning_potential, "row"_a, "nutation"_a);
    m.def("exact_map_plan", exact_map_plan, "scene"_a, "step"_a);
    m.def("exact_map_states", exact_map_states, "plan"_a, "k"_a);
}
