// Closed forms.
#include <algorithm>
#include <memory>
#include <vector>
#include "results.hpp"
#include "times.hpp"

// A closed form, in memory that Python cannot write.
class exact_plan
{
    std::unique_ptr<double[]> doubles;
    size_t size = 0;

    kr_exact *exact() const { return reinterpret_cast<kr_exact *>(doubles.get()); }

  public:
    // Computes the closed form of another scene. The object has none after a failure.
    kr_status plan(const kr_scene &scene, double bound)
    {
        const size_t needed = kr_exact_size(&scene) / sizeof(double) + 1;
        if (needed > size) doubles.reset(new double[needed]);
        size = std::max(size, needed);
        return kr_exact_plan(&scene, bound, exact());
    }
    // Frees the memory of the set-up.
    void shrink()
    {
        const size_t used = info().used / sizeof(double) + 1;
        if (used >= size) return;
        std::unique_ptr<double[]> copy(new double[used]);
        std::copy_n(doubles.get(), used - 1, copy.get());
        doubles = std::move(copy);
        size = used;
    }
    kr_exact_info info() const { return kr_exact_describe(exact()); }
    bool is_on_torus() const { return info().kind >= KR_KIND_KOWALEWSKI; }
    void states(size_t n, const double *t, kr_state *out) const
    {
        if (n == 1)
            *out = kr_exact_state(exact(), *t);
        else
            kr_exact_states(exact(), n, t, out);
    }
    kr_state state_at(const double turns[2]) const
    {
        return kr_exact_state_at(exact(), turns[0], turns[1]);
    }
    // Writes the period, the two mean rates, the three frequencies and the certificate, of which
    // those that the motion does not have are NaN.
    void write_numbers(double row[7]) const
    {
        const kr_exact_info i = info();
        const double rates[] = {i.period,       i.precession_rate, i.spin_angle_rate,
                                i.frequency[0], i.frequency[1],    i.frequency[2],
                                i.certificate};
        for (int k = 0; k < 7; k++) row[k] = is_on_torus() == (k >= 3) ? rates[k] : NAN;
    }
};
// Returns the name of the status, the text of the refusal, whether the motion is on a torus, and the
// closed form, which is None after a failure.
static py::tuple plan_exact(const kr_scene &scene, double bound)
{
    auto plan = std::make_unique<exact_plan>();
    const kr_status status = plan->plan(scene, bound);
    const char *refusal = kr_refusal_text(plan->info().refusal);
    if (status != KR_OK) return py::make_tuple(name_of(status), refusal, false, py::none());
    plan->shrink();
    const bool on_torus = plan->is_on_torus();
    return py::make_tuple(name_of(status), refusal, on_torus, std::move(plan));
}
static doubles exact_numbers_of(const exact_plan &plan)
{
    doubles numbers(py::ssize_t(7));
    plan.write_numbers(numbers.mutable_data());
    return numbers;
}
// Returns the states of a plan at the times t. Returns None if a time is not below `most`, or if
// the times need validation by Python.
static py::object exact_states(const exact_plan &plan, const py::object &t, double most)
{
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
static doubles exact_states_at(const exact_plan &plan, const doubles &turns)
{
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
// Writes the numbers of each top, as exact_plan::write_numbers does.
static py::tuple exact_numbers(const tops &all, size_t begin, size_t end, const py::object &out,
                               const std::shared_ptr<work> &with)
{
    double *to = in_place<double>(out, 7 * (end - begin));
    exact_plan plan;
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        const kr_status status = plan.plan(scene, 0.0);
        if (status == KR_OK) plan.write_numbers(to + 7 * i);
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
    exact_plan plan;
    return each_of(all, begin, end, with, [&](size_t i, const kr_scene &scene) {
        const kr_status status = plan.plan(scene, 0.0);
        if (status == KR_OK) plan.states(times, from + i * own, to + i * times);
        return status;
    });
}

static const char *const courses[] = {"resting", "circle",     "sleeping", "hanging",
                                      "steady",  "separatrix", "pendulum", "rosette",
                                      "loops",   "cusps",      "waves"};
// Writes the numbers of a kr_nutation to a row, and the index of its type of motion.
static kr_status read_turning(const kr_scene &scene, double *row, int8_t *course)
{
    kr_nutation r;
    const kr_status status = kr_exact_nutation(&scene, &r);
    if (status != KR_OK) return status;
    const double numbers[] = {r.least, r.greatest,   r.t_least, r.t_greatest,   r.critical_spin,
                              r.sum,   r.difference, r.inertia, r.axial_energy, r.lever};
    std::copy(std::begin(numbers), std::end(numbers), row);
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

void bind_exact(py::module_ &m);
void bind_exact(py::module_ &m)
{
    py::class_<exact_plan>(m, "ExactPlan");
    m.def("plan_exact", plan_exact, "scene"_a, "bound"_a);
    m.def("exact_numbers_of", exact_numbers_of, "plan"_a);
    m.def("exact_states", exact_states, "plan"_a, "t"_a, "most"_a);
    m.def("exact_states_at", exact_states_at, "plan"_a, "turns"_a);
    py::list names;
    for (const char *course : courses) names.append(course);
    m.attr("courses") = names;
    m.def("exact_numbers", exact_numbers, "tops"_a, "begin"_a, "end"_a, "out"_a, "work"_a);
    m.def("exact_states_of_tops", exact_states_of_tops, "tops"_a, "begin"_a, "end"_a, "out"_a,
          "t"_a, "work"_a);
    m.def("exact_turning", exact_turning, "scene"_a);
    m.def("exact_turnings", exact_turnings, "tops"_a, "begin"_a, "end"_a, "rows"_a, "courses"_a,
          "work"_a);
}
