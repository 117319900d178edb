// Ensembles in which each top is a separate run. They offer events between the times, tangents, and
// digits beyond doubles, which no worker of the core supports.
#include "results.hpp"
#include "tangents.hpp"

class single_file
{
    const kr_method *method;
    kr_config config;
    patience waiting;
    looked_for wanted; // the events, in their state before a run begins
    journal path, met;
    std::vector<kr_state> states, rest, last, last_low;
    std::vector<int64_t> met_by, last_of;

    // Records the states at the given times with their tangents.
    kr_status record_tangents(kr_top *top, size_t row, size_t n, const double *t, const results &to,
                              size_t *done)
    {
        const size_t wide = 6 * kr_tangent_columns(config.tangents), first = row * n * wide;
        double *high = to.tangents + first,
               *low = to.tangents_low ? to.tangents_low + first : nullptr;
        const kr_status status =
            follow_tangents(top, n, t, {wide, states.data(), rest.data(), high, low}, *done,
                            [&] { return patience::poll(&waiting); });
        to.truncation[row] = kr_top_describe(top).truncation;
        return status;
    }
    // Records the states at the given times and the events between them. Writes the number of
    // states to `done`.
    kr_status record(kr_top *top, size_t row, size_t n, const double *t, const results &to,
                     size_t *done)
    {
        if (config.tangents) return record_tangents(top, row, n, t, to, done);
        if (wanted.events.empty())
            return kr_top_record(top, n, t, states.data(), rest.data(), done);
        looked_for mine = wanted;
        kr_status status = kr_top_watch(top, mine.events.size(), mine.events.data());
        if (status != KR_OK) return status;
        path = {};
        status = follow(top, t, n, mine, path, met, [&] { return patience::poll(&waiting); });
        while (*done < path.states.size() && path.states[*done].t == t[*done]) ++*done;
        std::copy_n(path.states.begin(), *done, states.begin());
        std::copy_n(path.low.begin(), *done, rest.begin());
        return status;
    }
    void move(const kr_scene &scene, size_t row, size_t n, const double *t, const results &to)
    {
        const bool back = n > 0 && t[n - 1] < 0.0;
        kr_config mine = config;
        mine.step = led(mine.step, back);
        std::unique_ptr<kr_top, void (*)(kr_top *)> top{nullptr, kr_top_free};
        kr_top *made = nullptr;
        kr_outcome outcome = {};
        outcome.last = scene.start;
        kr_state low = {};
        outcome.status = kr_top_create(&scene, method, mine, &made);
        top.reset(made);
        if (outcome.status == KR_OK) {
            outcome.status = record(made, row, n, t, to, &outcome.done);
            outcome.last = kr_top_state(made);
            const kr_top_info info = kr_top_describe(made);
            outcome.stats = info.stats;
            low = info.low;
        }
        to.take(row, outcome);
        to.clear_tangents(row, n, outcome.done, 6 * kr_tangent_columns(config.tangents));
        if (outcome.done < n) {
            last.push_back(outcome.last);
            last_low.push_back(low);
            last_of.push_back(int64_t(row));
        }
        met_by.resize(met.states.size(), int64_t(row));
        for (size_t i = outcome.done; i < n; i++) {
            const kr_state none = {t[i], {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
            states[i] = rest[i] = none;
            rest[i].t = 0.0;
        }
        if (to.states) std::copy_n(states.begin(), n, to.states + row * n);
        if (to.low) std::copy_n(rest.begin(), n, to.low + row * n);
        to.take_columns(row, scene, n, outcome.done, states.data(), rest.data());
        waiting.did(1);
    }

  public:
    single_file(const std::string &name, double step, double tol, int digits, int64_t max_steps,
                bool leave_heading, const py::list &events, uint64_t tangents,
                std::shared_ptr<work> with)
        : method(method_of(name))
    {
        config = {step, tol, max_steps, patience::poll, &waiting, digits, leave_heading, tangents};
        waiting.shared = std::move(with);
        wanted.take(events);
    }
    single_file(const single_file &) = delete;
    single_file &operator=(const single_file &) = delete;

    // Runs the tops begin to end to their times, given by one row for all tops or one for each.
    // Returns the last states of tops that stopped early, their low words and indices, and the
    // events: (top, states, low, which, direction).
    py::tuple run(const tops &all, size_t begin, size_t end, const doubles &t, const results &to)
    {
        const size_t times = size_t(t.shape(t.ndim() - 1));
        const double *at = t.data();
        waiting.begin();
        {
            py::gil_scoped_release nogil;
            states.resize(times);
            rest.resize(times);
            kr_scene scene;
            for (size_t i = begin; i < end && !waiting.is_over(); i++) {
                all.fill(i, i + 1, &scene);
                move(scene, i - begin, times, at + (t.ndim() == 2 ? (i - begin) * times : 0), to);
            }
        }
        waiting.end();
        return py::make_tuple(array_of_states(last), array_of_states(last_low), numbers(last_of),
                              numbers(met_by), numbers_of(met));
    }

  private:
    static py::array_t<int64_t> numbers(const std::vector<int64_t> &list)
    {
        return py::array_t<int64_t>(py::ssize_t(list.size()), list.data());
    }
};

static py::tuple alone(const std::string &method, double step, double tol, int digits,
                       int64_t max_steps, bool leave_heading, const py::list &events,
                       const std::shared_ptr<work> &with, const tops &all, size_t begin, size_t end,
                       const doubles &t, const py::object &status, const py::object &done,
                       const py::object &counts, const py::object &reached,
                       const py::object &states, const py::object &low, const py::dict &columns,
                       uint64_t by, const py::object &tangents, const py::object &tangents_low,
                       const py::object &truncation)
{
    check_range(all, begin, end, t);
    const size_t n = end - begin, times = size_t(t.shape(t.ndim() - 1));
    results to =
        results_of(n, times, status, done, counts, reached, states, py::none(), 0, columns);
    if (!low.is_none()) to.low = reinterpret_cast<kr_state *>(in_place<double>(low, 8 * n * times));
    if (by) {
        const size_t count = n * times * 6 * kr_tangent_columns(by);
        to.tangents = in_place<double>(tangents, count);
        if (!tangents_low.is_none()) to.tangents_low = in_place<double>(tangents_low, count);
        to.truncation = in_place<double>(truncation, n);
    }
    single_file file(method, step, tol, digits, max_steps, leave_heading, events, by, with);
    return file.run(all, begin, end, t, to);
}

void bind_alone(py::module_ &m);
void bind_alone(py::module_ &m)
{
    m.def("alone", alone, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a,
          "leave_heading"_a, "events"_a, "work"_a, "tops"_a, "begin"_a, "end"_a, "t"_a, "status"_a,
          "done"_a, "counts"_a, "reached"_a, "states"_a, "low"_a, "columns"_a, "by"_a = 0,
          "tangents"_a = py::none(), "tangents_low"_a = py::none(), "truncation"_a = py::none());
}
