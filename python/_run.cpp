// Runs of single tops: the GIL is released, signals and progress are handled, and checkpoints are
// saved and loaded.
#include <atomic>
#include <pybind11/stl.h>
#include <limits>
#include "events.hpp"
#include "fast_call.hpp"
#include "paths.hpp"
#include "tangents.hpp"
#include "times.hpp"
#include "tops.hpp"
#include "watch.hpp"

// Options of a run.
struct steering {
    const kr_method *method;
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

// States at the requested times, their low words or None, and the status of their computation.
struct recorded {
    kr_status status;
    doubles states;
    py::object low;
};

class run
{
    watch watching;
    looked_for wanted;
    std::unique_ptr<kr_top, void (*)(kr_top *)> top{nullptr, kr_top_free};
    std::atomic<bool> busy{false}, has_ended{false};
    std::atomic<double> reached_time{0.0}; // at the end of the last call
    py::ssize_t columns = 0;               // number of columns of the tangents
    double forward = 1.0;                  // -1: back in time

  public:
    static constexpr const char *under_way =
        "this run is under way: another thread leads it, or a call that has not yet returned";
    // Lock of a run: one thread at a time may use the run, and its own progress function may not.
    struct turn {
        std::atomic<bool> &busy;
        const bool is_mine;
        turn(run &one, bool must) : busy(one.busy), is_mine(!busy.exchange(true))
        {
            if (must && !is_mine) throw std::runtime_error(under_way);
        }
        turn(const turn &) = delete;
        turn &operator=(const turn &) = delete;
        ~turn()
        {
            if (is_mine) busy = false;
        }
    };

    py::object led_by;    // the request with which the run was started, or NULL
    double horizon = 0.0; // times that are certainly not too late for the scene are below this one

    kr_status start(kr_scene scene, const steering &how, bool back, const origin &begin)
    {
        const double step = led(how.step, back);
        const kr_config config = {step,      how.tol,    how.max_steps,     watch::poll,
                                  &watching, how.digits, how.leave_heading, how.tangents};
        columns = py::ssize_t(kr_tangent_columns(how.tangents));
        forward = back ? -1.0 : 1.0;
        kr_top *raw = nullptr;
        scene.start.t = begin.t;
        const kr_status status = kr_top_create(&scene, how.method, config, &raw);
        top.reset(raw);
        watching.top = raw;
        reached_time = begin.t;
        if (status != KR_OK || begin.low.is_none()) return status;
        const auto low = value_of<kr_state>(begin.low.cast<doubles>());
        return kr_top_set_scene(raw, &scene, &low);
    }
    // Returns the state at the last time reached, and its low words.
    py::tuple state()
    {
        const turn mine(*this, true);
        return py::make_tuple(array_of(kr_top_state(top.get())),
                              array_of(kr_top_describe(top.get()).low));
    }
    kr_status look_for(const py::list &events)
    {
        wanted.take(events);
        return kr_top_watch(top.get(), wanted.events.size(), wanted.events.data());
    }
    py::tuple record(const given_times &t, bool low_too, const py::object &progress)
    {
        const turn mine(*this, true);
        return result_of(record_states(t, low_too, progress));
    }
    // Returns a result of `record_states` as Python reads it.
    py::tuple result_of(const recorded &result) const
    {
        return py::make_tuple(name_of(result.status), result.states, result.low,
                              counts(kr_top_describe(top.get()).stats), watching.end);
    }
    recorded record_states(const given_times &t, bool low_too, const py::object &progress)
    {
        doubles out = new_states(t.size());
        py::object low = py::none();
        auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
        kr_state *rest = nullptr;
        if (low_too) {
            doubles rows = new_states(t.size());
            rest = reinterpret_cast<kr_state *>(rows.mutable_data());
            low = rows;
        }
        size_t done = 0;
        watching.end = t.end();
        const kr_status status = go(progress, [&] {
            return kr_top_record(top.get(), t.size(), t.data(), states, rest, &done);
        });
        if (status != KR_OK) {
            const kr_state last = kr_top_state(top.get());
            const bool more = done < t.size() && (done == 0 || states[done - 1].t != last.t);
            if (more) states[done] = last;
            if (more && rest) rest[done] = kr_top_describe(top.get()).low;
            out = reached(out, done + more);
            if (rest) low = reached(low, done + more);
        }
        return {status, out, low};
    }
    // Makes `t` the times of a call after the time reached, if they need no further validation.
    // Returns false otherwise.
    bool follow_on(given_times &t, double most) const
    {
        const double now = reached_time;
        t.begin_at(now);
        return t.size() > 0 && t.are_below(most) && t.lead_from(forward * now, forward);
    }
    // Records states with their tangents. Returns the result for the states, the tangents, their
    // low words, and the largest relative truncation error of the tangents. Up to 16 digits the low
    // words of tangents are zero.
    py::tuple record_tangents(const doubles &t, bool low_too, const py::object &progress)
    {
        const turn mine(*this, true);
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
                                         counts(kr_top_describe(top.get()).stats), watching.end);
        return py::make_tuple(rows, reached(carried, done), reached(rest, done),
                              kr_top_describe(top.get()).truncation);
    }
    // Records the states at given times and the events between them: (states, low words, which,
    // direction).
    py::tuple record_events(const doubles &t, const py::object &progress)
    {
        const turn mine(*this, true);
        journal path, met;
        const double *times = t.data();
        const auto n = size_t(t.size());
        watching.end = n ? times[n - 1] : 0.0;
        const kr_status status = go(progress, [&] {
            return follow(top.get(), times, n, wanted, path, met,
                          [&] { return watch::poll(&watching); });
        });
        return py::make_tuple(
            py::make_tuple(name_of(status), array_of_states(path.states), array_of_states(path.low),
                           counts(kr_top_describe(top.get()).stats), watching.end),
            numbers_of(met));
    }
    py::bytes save()
    {
        const turn mine(*this, true);
        std::string memory(kr_top_save_size(top.get()), '\0');
        kr_top_save(top.get(), memory.size(), &memory[0]);
        return memory;
    }
    const char *load(const std::string &memory, const std::vector<int64_t> &found)
    {
        const turn mine(*this, true);
        if (found.size() != wanted.found.size()) return name_of(KR_ERR_CHECKPOINT);
        const kr_status status = kr_top_load(top.get(), memory.size(), memory.data());
        if (status == KR_OK) wanted.found = found;
        has_ended = wanted.ended();
        reached_time = kr_top_state(top.get()).t;
        return name_of(status);
    }
    py::tuple kernel() const
    {
        const kr_top_info info = kr_top_describe(top.get());
        return py::make_tuple(info.kernel, info.order);
    }
    double time() const { return reached_time; }
    kr_state present() const { return kr_top_state(top.get()); }
    // Restarts the motion with another scene at the present time. On failure nothing changes.
    kr_status restart(kr_scene scene)
    {
        scene.start.t = reached_time;
        const kr_status status = kr_top_set_scene(top.get(), &scene, nullptr);
        if (status == KR_OK) has_ended = false;
        return status;
    }
    kr_stats stats() const { return kr_top_describe(top.get()).stats; }
    std::vector<int64_t> found()
    {
        const turn mine(*this, true);
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
    const steering how = {method_of(method), step, tol, digits, max_steps, leave_heading, tangents};
    kr_status status = made->start(scene, how, back, {begin, low});
    if (status == KR_OK && !events.empty()) status = made->look_for(events);
    return py::make_tuple(name_of(status),
                          status == KR_OK ? py::cast(std::move(made)) : py::none());
}
// Returns all states of a run at validated times in one call.
static py::tuple record(const kr_scene &scene, const std::string &method, double step, double tol,
                        int digits, int64_t max_steps, bool leave_heading, const doubles &t,
                        const py::object &progress, double begin, const py::object &low)
{
    given_times times;
    times.take(t);
    run once;
    const steering how = {method_of(method), step, tol, digits, max_steps, leave_heading, 0};
    const kr_status status = once.start(scene, how, times.end() < 0.0, {begin, low});
    if (status == KR_OK) return once.record(times, digits > 16, progress);
    doubles begun({py::ssize_t(1), py::ssize_t(8)});
    std::memcpy(begun.mutable_data(), &scene.start, sizeof scene.start);
    *begun.mutable_data() = begin;
    return py::make_tuple(name_of(status), begun, py::none(), counts(kr_stats()), times.end());
}

// A validated request, with which kreisel.solve takes a single call.
class request
{
    steering how;
    double most;       // times that are certainly not too late are below this one
    py::ssize_t limit; // the largest number of states
    py::object options;
    path_maker paths;
    scene_maker scenes;
    py::object closed; // for 'auto': the request of the closed form, else None
    // None, or a function that returns the largest certificate with which 'auto' uses the closed
    // form of a top on a torus, or 0.
    py::object decide;

    // Returns a time up to which Python certainly refuses no time of the scene.
    static double certain_horizon(const kr_scene &scene) { return 0.5 * kr_scene_horizon(&scene); }
    // Reads a momentum and, unless it is None, an attitude. Returns false if they are not numbers.
    static bool read_start(const py::handle &momentum, const py::handle &attitude, kr_state &start)
    {
        double m[3], q[4];
        if (!numbers_of(momentum, m)) return false;
        start.m = {m[0], m[1], m[2]};
        if (attitude.is_none()) return true;
        if (!numbers_of(attitude, q)) return false;
        start.q = {q[0], q[1], q[2], q[3]};
        return true;
    }
    // Updates the time of a kreisel.Run after its motion was advanced.
    void arrive(const py::handle &motion, const py::handle &owner, const run &moving) const
    {
        // Another thread may have changed the run at the same moment.
        if (!get(owner, paths.name.motion).is(motion)) throw std::runtime_error(run::under_way);
        set(owner, paths.name.t, py::float_(moving.time()));
        set(owner, paths.name.is_fresh, py::bool_(false));
    }
    // Returns the path of a scene, as `solve` does. Returns a null object if the method refuses the
    // scene with the tolerance `tol`.
    py::object record(const py::handle &scene, const kr_scene &block, const py::handle &t,
                      const py::object &progress, double tol) const
    {
        given_times times;
        if (!times.take(t)) return py::none();
        times.begin_at(0.0);
        const double horizon = get(scene, paths.name.horizon).cast<double>();
        if (py::ssize_t(times.size()) > limit || !times.are_below(std::min(most, horizon)) ||
            !times.lead_away())
            return py::none();
        run once;
        const bool back = times.end() < 0.0;
        steering with = how;
        with.tol = tol;
        const kr_status status = once.start(block, with, back, {0.0, py::none()});
        if (status != KR_OK) return status == KR_ERR_METHOD ? py::object() : py::none();
        const recorded result = once.record_states(times, how.digits > 16, progress);
        if (result.status != KR_OK || !paths.knows_columns())
            return py::make_tuple(options, once.result_of(result));
        const auto stats = paths.stats_of(once.stats());
        auto path = paths.make(scene, result.states, result.low, stats, back && how.step > 0.0);
        if (!progress.is_none() && times.size() > 0) progress(times.end());
        return path;
    }
    py::object record_or_none(const py::handle &scene, const kr_scene &block, const py::handle &t,
                              const py::object &progress) const
    {
        const auto path = record(scene, block, t, progress, how.tol);
        return path ? path : py::none();
    }

  public:
    request(const path_maker &paths, const scene_maker &scenes, py::object options,
            const steering &how, double most, py::ssize_t limit, py::object closed,
            py::object decide)
        : how(how), most(most), limit(limit), options(std::move(options)), paths(paths),
          scenes(scenes), closed(std::move(closed)), decide(std::move(decide))
    {
    }
    // Starts a run. Returns the name of the status and the run, or None if the core rejects it.
    py::tuple start(const py::object &self, const kr_scene &block, bool back, double begin,
                    const py::object &low) const
    {
        auto made = std::make_unique<run>();
        const kr_status status = made->start(block, how, back, {begin, low});
        if (status != KR_OK) return py::make_tuple(name_of(status), py::none());
        made->led_by = self;
        made->horizon = certain_horizon(block);
        return py::make_tuple(name_of(status), py::cast(std::move(made)));
    }
    // Advances a kreisel.Run, whose motion is `moving`, and returns its path at the times as given.
    // Returns None if the arguments need validation, and the result of the core if the run failed.
    py::object advance(const py::handle &motion, const py::handle &owner, const py::handle &t,
                       const py::object &progress) const
    {
        auto &moving = instance_of<run>(motion.ptr());
        const run::turn mine(moving, false);
        given_times times;
        if (!mine.is_mine || moving.ended() || !paths.knows_columns() || !times.take(t))
            return py::none();
        const py::object scene = get(owner, paths.name.scene);
        if (!moving.follow_on(times, std::min(most, moving.horizon)) ||
            py::ssize_t(times.size()) > limit)
            return py::none();
        try {
            const recorded result = moving.record_states(times, how.digits > 16, progress);
            arrive(motion, owner, moving);
            if (result.status != KR_OK) return moving.result_of(result);
            const py::object stats = paths.stats_of(moving.stats());
            set(owner, paths.name.stats, stats);
            const bool is_back = times.end() < 0.0 && how.step > 0.0;
            auto path = paths.make(scene, result.states, result.low, stats, is_back);
            set(path, paths.name.origin, get(owner, paths.name.origin));
            return path;
        } catch (py::error_already_set &) {
            arrive(motion, owner, moving);
            throw;
        }
    }
    // Restarts a kreisel.Run at the present time with another momentum and, unless it is None,
    // another attitude. Returns false, and changes nothing, if the arguments need validation.
    bool reset(const py::handle &motion, const py::handle &owner, const py::handle &momentum,
               const py::handle &attitude) const
    {
        auto &moving = instance_of<run>(motion.ptr());
        const run::turn mine(moving, false);
        const py::object scene = get(owner, paths.name.scene);
        // Other runs need the low words of the state, or lack the heading.
        if (!mine.is_mine || how.digits > 16 || how.leave_heading || !scenes.makes(scene))
            return false;
        if (!get(owner, paths.name.motion).is(motion)) return false;
        kr_scene next = get(scene, paths.name.block).cast<kr_scene>();
        next.start = moving.present();
        next.start.t = 0.0;
        if (!read_start(momentum, attitude, next.start) || kr_scene_check(&next) != KR_OK)
            return false;
        const double now = moving.time();
        const double horizon = certain_horizon(next);
        if (!(std::fabs(now) < std::min(most, horizon))) return false;
        const py::object begun = py::type::of(get(owner, paths.name.origin));
        const py::object made = scenes.make(scene, next), stats = paths.stats_of(kr_stats()),
                         origin = instantiate_tuple(begun, py::float_(now), py::none());
        if (moving.restart(next) != KR_OK) return false;
        moving.horizon = horizon;
        set(owner, paths.name.scene, made);
        set(owner, paths.name.stats, stats);
        set(owner, paths.name.origin, origin);
        set(owner, paths.name.is_fresh, py::bool_(true));
        return true;
    }
    // Returns the path of a scene at the times as given. Returns None if the arguments need
    // validation or the method does not apply. Returns the options and the result of the core if
    // the run failed, or if the core does not know all wanted quantities.
    py::object solve(const py::handle &scene, const py::handle &t, const py::object &progress) const
    {
        const auto block = get(scene, paths.name.block).cast<kr_scene>();
        py::object path;
        if (!closed.is_none()) {
            const auto &other = instance_of<request>(closed.ptr());
            if (!has_torus(block))
                return (kr_method_suits(other.how.method, &block) ? other : *this)
                    .record_or_none(scene, block, t, progress);
            const double most = decide.is_none() || !t ? 0.0 : decide(scene, t).cast<double>();
            if (most > 0.0) path = other.record(scene, block, t, progress, most);
        }
        return path ? path : record_or_none(scene, block, t, progress);
    }
};
static std::unique_ptr<request> make_request(const py::tuple &classes, const py::object &options,
                                             const py::object &stored, const py::tuple &core,
                                             const py::object &want, double most, py::ssize_t limit,
                                             const py::object &closed, const py::object &decide)
{
    const auto method = core[0].cast<std::string>();
    const steering how = {method_of(method),
                          core[1].cast<double>(),
                          core[2].cast<double>(),
                          core[3].cast<int>(),
                          core[4].cast<int64_t>(),
                          core[5].cast<bool>(),
                          0};
    return std::make_unique<request>(path_maker(classes[0], classes[1], stored, want),
                                     scene_maker(classes[2]), options, how, most, limit, closed,
                                     decide);
}
// Returns the times of a list, a tuple or an array as an array of doubles. Returns None if Python
// must validate them: if they are not plain numbers, not finite or not leading away from 0.
static py::object plain_times(const py::object &t)
{
    given_times times;
    if (!times.take(t) || times.is_number || !times.lead_away() ||
        !times.are_below(std::numeric_limits<double>::infinity()))
        return py::none();
    return py::array_t<double>(py::ssize_t(times.size()), times.data());
}
static PyObject *solve(PyObject *self, PyObject *const *given, Py_ssize_t n)
{
    return guarded([&] {
        if (n != 3) throw py::type_error("solve takes a scene, times and progress");
        return instance_of<request>(self).solve(given[0], given[1],
                                                py::reinterpret_borrow<py::object>(given[2]));
    });
}
static PyObject *advance(PyObject *self, PyObject *const *given, Py_ssize_t n)
{
    return guarded([&]() -> py::object {
        if (n != 3) throw py::type_error("advance takes a run, times and progress");
        const auto &led_by = instance_of<run>(self).led_by;
        if (!led_by) return py::none();
        return instance_of<request>(led_by.ptr())
            .advance(self, given[0], given[1], py::reinterpret_borrow<py::object>(given[2]));
    });
}
static PyObject *reset(PyObject *self, PyObject *const *given, Py_ssize_t n)
{
    return guarded([&] {
        if (n != 3) throw py::type_error("reset takes a run, a momentum and an attitude");
        const auto &led_by = instance_of<run>(self).led_by;
        return py::bool_(
            led_by && instance_of<request>(led_by.ptr()).reset(self, given[0], given[1], given[2]));
    });
}
static py::tuple start_request(const py::object &self, const kr_scene &block, bool back,
                               double begin, const py::object &low)
{
    return instance_of<request>(self.ptr()).start(self, block, back, begin, low);
}

void bind_run(py::module_ &m);
void bind_run(py::module_ &m)
{
    py::class_<run> runs(m, "Run");
    runs.def("record", record_more, "t"_a, "low"_a, "progress"_a = py::none())
        .def("record_tangents", &run::record_tangents, "t"_a, "low"_a, "progress"_a = py::none())
        .def("record_events", &run::record_events, "t"_a, "progress"_a = py::none())
        .def("state", &run::state)
        .def("save", &run::save)
        .def("load", &run::load, "memory"_a, "found"_a)
        .def_property_readonly("found", &run::found)
        .def_property_readonly("ended", &run::ended)
        .def_property_readonly("kernel", &run::kernel)
        .def_property_readonly("t", &run::time);
    static PyMethodDef advance_method = fast_method(
        "advance", advance,
        "Return the next path of a kreisel.Run. None: the arguments need validation. A tuple: the "
        "result of the core, from which no path was made.");
    static PyMethodDef solve_method = fast_method(
        "solve", solve,
        "Return the path of a scene at times. None: the arguments need validation. A tuple: the "
        "options and the result of the core, from which no path was made.");
    static PyMethodDef reset_method = fast_method(
        "reset", reset,
        "Restart a kreisel.Run at the present time. False: the arguments need validation.");
    add_method(runs, advance_method);
    add_method(runs, reset_method);
    py::class_<request> requests(m, "Request");
    requests.def(py::init(&make_request), "classes"_a, "options"_a, "stored"_a, "core"_a, "want"_a,
                 "most"_a, "limit"_a, "closed"_a = py::none(), "decide"_a = py::none());
    requests.def("start", start_request, "scene"_a, "back"_a, "begin"_a, "low"_a);
    add_method(requests, solve_method);
    m.def("start", start, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a,
          "leave_heading"_a = false, "back"_a = false, "events"_a = py::list(), "tangents"_a = 0,
          "begin"_a = 0.0, "low"_a = py::none());
    m.def("plain_times", plain_times, "t"_a);
    m.def("record", record, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a,
          "leave_heading"_a, "t"_a, "progress"_a = py::none(), "begin"_a = 0.0,
          "low"_a = py::none());
}
