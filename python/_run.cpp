// Runs of single tops: the GIL is released, signals and progress are handled, and checkpoints are
// saved and loaded.
#include <atomic>
#include <pybind11/stl.h>
#include <limits>
#include "events.hpp"
#include "tangents.hpp"
#include "times.hpp"
#include "watch.hpp"

// Options of a run, as Python passes them.
struct steering {
    std::string method;
    double step, tol;
    int digits;
    int64_t max_steps;
    bool leave_heading;
    uint64_t tangents;
};
// The time at which a run starts, and the low words of its initial state. `low` is an array of 8
// doubles, or None.
struct origin {
    double t;
    const py::object &low;
};
// Returns the first `rows` rows of an array, without a copy: the states that were written, and the
// last valid state if it is later.
static doubles reached(const doubles &out, size_t rows)
{
    return py::object(out[py::slice(0, py::ssize_t(rows), 1)]);
}

class run
{
    watch watching;
    looked_for wanted;
    std::unique_ptr<kr_top, void (*)(kr_top *)> top{nullptr, kr_top_free};
    std::atomic<bool> busy{false}, has_ended{false};
    std::atomic<double> reached_time{0.0}; // at the end of the last call
    py::ssize_t columns = 0;               // number of columns of the tangents

    // Lock of a run: one thread at a time may use the run, and its own progress function may not.
    struct turn {
        std::atomic<bool> &busy;
        explicit turn(std::atomic<bool> &flag) : busy(flag)
        {
            if (busy.exchange(true))
                throw std::runtime_error(
                    "this run is under way: another thread leads it, or a call that has not yet "
                    "returned");
        }
        ~turn() { busy = false; }
    };

  public:
    kr_status start(kr_scene scene, const steering &how, bool back, const origin &begin)
    {
        const double step = led(how.step, back);
        const kr_config config = {step,      how.tol,    how.max_steps,     watch::poll,
                                  &watching, how.digits, how.leave_heading, how.tangents};
        columns = py::ssize_t(kr_tangent_columns(how.tangents));
        kr_top *raw = nullptr;
        scene.start.t = begin.t;
        const kr_status status = kr_top_create(&scene, method_of(how.method), config, &raw);
        top.reset(raw);
        watching.top = raw;
        reached_time = begin.t;
        if (status != KR_OK || begin.low.is_none()) return status;
        const auto low = value_of<kr_state>(begin.low.cast<doubles>());
        return kr_top_set_scene_low(raw, &scene, &low);
    }
    // Returns the state at the last time reached, and its low words.
    py::tuple state()
    {
        const turn mine(busy);
        return py::make_tuple(array_of(kr_top_state(top.get())), array_of(kr_top_low(top.get())));
    }
    kr_status look_for(const py::list &events)
    {
        wanted.take(events);
        return kr_top_watch(top.get(), wanted.events.size(), wanted.events.data());
    }
    py::tuple record(const given_times &t, bool low_too, const py::object &progress)
    {
        const turn mine(busy);
        const py::ssize_t n = py::ssize_t(t.size());
        doubles out({n, py::ssize_t(8)});
        py::object low = py::none();
        auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
        kr_state *rest = nullptr;
        if (low_too) {
            doubles rows({n, py::ssize_t(8)});
            rest = reinterpret_cast<kr_state *>(rows.mutable_data());
            low = rows;
        }
        size_t done = 0;
        watching.end = t.end();
        const kr_status status = go(progress, [&] {
            return kr_top_record_low(top.get(), t.size(), t.data(), states, rest, &done);
        });
        if (status != KR_OK) {
            const kr_state last = kr_top_state(top.get());
            const bool more = done < t.size() && (done == 0 || states[done - 1].t != last.t);
            if (more) states[done] = last;
            if (more && rest) rest[done] = kr_top_low(top.get());
            out = reached(out, done + more);
            if (rest) low = reached(low, done + more);
        }
        return py::make_tuple(name_of(status), out, low, counts(kr_top_stats(top.get())), t.end());
    }
    // Records states with their tangents, the low words, and the largest last term of the series:
    // (states, tangents, low words, rest). Up to 16 digits the low words of tangents are zero.
    py::tuple record_tangents(const doubles &t, bool low_too, const py::object &progress)
    {
        const turn mine(busy);
        const py::ssize_t n = t.size(), wide = 6 * columns;
        doubles out({n, py::ssize_t(8)}), carried({n, wide}), rest = zeros(n, wide), low;
        if (low_too) low = doubles({n, py::ssize_t(8)});
        auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
        auto *lows = low_too ? reinterpret_cast<kr_state *>(low.mutable_data()) : nullptr;
        const double *times = t.data();
        double *high = carried.mutable_data(), *under = low_too ? rest.mutable_data() : nullptr;
        size_t done = 0;
        watching.end = n ? times[n - 1] : 0.0;
        const kr_status status = go(progress, [&] {
            return follow_tangents(top.get(), size_t(n), times,
                                   {size_t(wide), states, lows, high, under}, done,
                                   [&] { return watch::poll(&watching); });
        });
        const auto rows = py::make_tuple(name_of(status), reached(out, done),
                                         low_too ? py::object(reached(low, done)) : py::none(),
                                         counts(kr_top_stats(top.get())), watching.end);
        return py::make_tuple(rows, reached(carried, done), reached(rest, done),
                              kr_top_tangent_truncation(top.get()));
    }
    // Records the states at given times and the events between them: (states, low words, which,
    // direction).
    py::tuple record_events(const doubles &t, const py::object &progress)
    {
        const turn mine(busy);
        journal path, met;
        const double *times = t.data();
        const auto n = size_t(t.size());
        watching.end = n ? times[n - 1] : 0.0;
        const kr_status status = go(progress, [&] {
            return follow(top.get(), times, n, wanted, path, met,
                          [&] { return watch::poll(&watching); });
        });
        return py::make_tuple(py::make_tuple(name_of(status), array_of_states(path.states),
                                             array_of_states(path.low),
                                             counts(kr_top_stats(top.get())), watching.end),
                              numbers_of(met));
    }
    py::bytes save()
    {
        const turn mine(busy);
        std::string memory(kr_top_save_size(top.get()), '\0');
        kr_top_save(top.get(), memory.size(), &memory[0]);
        return memory;
    }
    const char *load(const std::string &memory, const std::vector<int64_t> &found)
    {
        const turn mine(busy);
        if (found.size() != wanted.found.size()) return name_of(KR_ERR_CHECKPOINT);
        const kr_status status = kr_top_load(top.get(), memory.size(), memory.data());
        if (status == KR_OK) wanted.found = found;
        has_ended = wanted.ended();
        reached_time = kr_top_state(top.get()).t;
        return name_of(status);
    }
    py::tuple kernel() const
    {
        int order = 0;
        const char *name = kr_top_kernel(top.get(), &order);
        return py::make_tuple(name, order);
    }
    double time() const { return reached_time; }
    std::vector<int64_t> found()
    {
        const turn mine(busy);
        return wanted.found;
    }
    bool ended() const { return has_ended; }

  private:
    template <class Way> kr_status go(const py::object &progress, Way way)
    {
        kr_status status;
        watching.begin(progress);
        {
            py::gil_scoped_release nogil;
            status = way();
        }
        if (status == KR_OK && watch::poll(&watching)) status = KR_ERR_INTERRUPTED;
        reached_time = kr_top_state(top.get()).t;
        has_ended = wanted.ended();
        watching.progress = py::none();
        // An exception refers to frames, which may refer to this run. The exception is therefore
        // not stored.
        const auto raised = std::move(watching.raised);
        if (raised && !raised->matches(PyExc_KeyboardInterrupt)) throw *raised;
        return status;
    }
};

static py::tuple record_more(run &top, const doubles &t, bool low_too, const py::object &progress)
{
    given_times times;
    times.take(t);
    return top.record(times, low_too, progress);
}
static py::tuple start(const kr_scene &scene, const std::string &method, double step, double tol,
                       int digits, int64_t max_steps, bool leave_heading, bool back,
                       const py::list &events, uint64_t tangents, double begin,
                       const py::object &low)
{
    auto made = std::make_unique<run>();
    const steering how = {method, step, tol, digits, max_steps, leave_heading, tangents};
    kr_status status = made->start(scene, how, back, {begin, low});
    if (status == KR_OK && !events.empty()) status = made->look_for(events);
    return py::make_tuple(name_of(status),
                          status == KR_OK ? py::cast(std::move(made)) : py::none());
}
// Returns all states of a run in one call. A single number t means the two times 0 and t. Returns
// None if Python must validate the times: if they are not plain numbers, not all below `most`, not
// leading away from 0, or more than `limit`.
static py::object record(const kr_scene &scene, const std::string &method, double step, double tol,
                         int digits, int64_t max_steps, bool leave_heading, const py::object &t,
                         double most, py::ssize_t limit, const py::object &progress, double begin,
                         const py::object &low)
{
    given_times times;
    if (!times.take(t)) return py::none();
    times.begin_at_start();
    if (py::ssize_t(times.size()) > limit || !times.are_below(most) || !times.lead_away())
        return py::none();
    run once;
    const steering how = {method, step, tol, digits, max_steps, leave_heading, 0};
    const kr_status status = once.start(scene, how, times.end() < 0.0, {begin, low});
    if (status == KR_OK) return once.record(times, digits > 16, progress);
    doubles begun({py::ssize_t(1), py::ssize_t(8)});
    std::memcpy(begun.mutable_data(), &scene.start, sizeof scene.start);
    *begun.mutable_data() = begin;
    return py::make_tuple(name_of(status), begun, py::none(), counts(kr_stats()), times.end());
}

void bind_run(py::module_ &m);
void bind_run(py::module_ &m)
{
    py::class_<run>(m, "Run")
        .def("record", record_more, "t"_a, "low"_a, "progress"_a = py::none())
        .def("record_tangents", &run::record_tangents, "t"_a, "low"_a, "progress"_a = py::none())
        .def("record_events", &run::record_events, "t"_a, "progress"_a = py::none())
        .def("state", &run::state)
        .def("save", &run::save)
        .def("load", &run::load, "memory"_a, "found"_a)
        .def_property_readonly("found", &run::found)
        .def_property_readonly("ended", &run::ended)
        .def_property_readonly("kernel", &run::kernel)
        .def_property_readonly("t", &run::time);
    m.def("start", start, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a,
          "leave_heading"_a = false, "back"_a = false, "events"_a = py::list(), "tangents"_a = 0,
          "begin"_a = 0.0, "low"_a = py::none());
    m.def("record", record, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a,
          "leave_heading"_a, "t"_a, "most"_a = std::numeric_limits<double>::infinity(),
          "limit"_a = std::numeric_limits<py::ssize_t>::max(), "progress"_a = py::none(),
          "begin"_a = 0.0, "low"_a = py::none());
}
