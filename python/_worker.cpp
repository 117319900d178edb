// Ensembles in workers of the core. A call runs a range of tops, a few hundred at a time, with the
// GIL released. If the shared work permits, a call starts its own threads, which start faster than
// Python's. Through the shared work, the thread that waits for several such calls can stop them and
// read their progress.
#include <future>
#include <optional>
#include <system_error>
#include "results.hpp"

// A task: n tops from `begin` on, which run to their times or to an event as `these` specifies, and
// the arrays of their results.
struct task {
    const tops &all;
    size_t begin, n;
    kr_tops these;
    const results &to;
    const kr_event *event;
};

// The worker of one thread, and the failures of its tops.
class mover
{
    using owned = std::unique_ptr<kr_worker, void (*)(kr_worker *)>;
    owned core{nullptr, kr_worker_free};
    size_t reductions;
    bool has_closed_forms; // the method is exact, or 'auto'
    std::vector<kr_scene> scenes;
    std::vector<kr_outcome> outcomes;
    std::vector<kr_state> scratch; // states of tops of which only quantities are wanted

    // Runs n tops of a task; their results begin at row `at`.
    void move(const task &asked, size_t at, size_t n)
    {
        const results &to = asked.to;
        kr_tops these = asked.these;
        const size_t times = these.times;
        asked.all.fill(asked.begin + at, asked.begin + at + n, scenes.data());
        these.n = n;
        these.scenes = scenes.data();
        these.outcomes = outcomes.data();
        if (these.own_times) these.t += at * (asked.event ? 1 : times);
        these.states = to.states         ? to.states + at * times
                       : scratch.empty() ? nullptr
                                         : scratch.data();
        these.reduced = to.reduced ? to.reduced + at * reductions : nullptr;
        if (asked.event)
            kr_worker_section(core.get(), asked.event, &these);
        else
            kr_worker_run(core.get(), &these);
        for (size_t i = 0; i < n; i++) {
            to.take(at + i, outcomes[i]);
            if (outcomes[i].status != KR_OK) {
                last.push_back(outcomes[i].last);
                failed.push_back(int64_t(at + i));
            }
            if (these.states)
                to.take_columns(at + i, scenes[i], times, outcomes[i].done,
                                these.states + i * times, nullptr);
        }
        waiting.did(int64_t(n));
    }

  public:
    patience waiting;
    std::vector<kr_state> last;
    std::vector<int64_t> failed; // the rows of the last states

    mover(const kr_method *method, kr_config config, const std::vector<kr_reduction> &kept,
          std::shared_ptr<work> with)
        : reductions(kept.size()),
          has_closed_forms(!method || (kr_method_describe(method).flags & KR_METHOD_INTEGRABLE))
    {
        waiting.shared = std::move(with);
        config.poll = patience::poll;
        config.context = &waiting;
        kr_worker *made = nullptr;
        const kr_status status = kr_worker_create(method, config, kept.size(), kept.data(), &made);
        if (status == KR_ERR_MEMORY) throw std::bad_alloc();
        if (status != KR_OK) throw py::value_error(name_of(status));
        core.reset(made);
    }
    mover(const mover &) = delete;
    mover &operator=(const mover &) = delete;
    const kr_worker *of_core() const { return core.get(); }

    // Runs a task, or those of its ranges that this thread takes.
    void go(const task &asked)
    {
        const size_t n = asked.n, times = asked.these.times, most = 512, memory = 1 << 18;
        // Closed forms of several tops are evaluated together if their states are stored. With more
        // times this would gain little.
        const bool in_batches = has_closed_forms && !asked.event && times <= 64;
        const bool lean = !asked.to.states && (!asked.to.columns.empty() || in_batches);
        size_t piece = std::min(n, most);
        if (lean) piece = std::min(piece, std::max(size_t(8), memory / (times + 1)));
        work *shared = waiting.shared && waiting.shared->threads ? waiting.shared.get() : nullptr;
        last.clear();
        failed.clear();
        scenes.resize(piece);
        outcomes.resize(piece);
        scratch.resize(lean ? piece * times : 0);
        size_t at = 0, count = std::min(piece, n);
        const auto is_more = [&] { return shared ? shared->take(piece, at, count) : at < n; };
        for (; !waiting.is_over() && is_more(); at += count, count = std::min(piece, n - at))
            move(asked, at, count);
    }
};

class worker
{
    const kr_method *method;
    kr_config config;
    std::vector<kr_reduction> kept;
    std::shared_ptr<work> shared;
    std::vector<std::unique_ptr<mover>> movers; // the first belongs to the calling thread

    // Starts all movers, each except the first on a thread of its own, as long as threads are
    // available. When the first mover is done, the calling thread waits for the others and handles
    // signals meanwhile.
    void go(const task &asked)
    {
        std::vector<std::future<void>> others;
        patience &waiting = movers[0]->waiting;
        try {
            for (size_t i = 1; i < movers.size(); i++)
                others.push_back(
                    std::async(std::launch::async, &mover::go, movers[i].get(), std::cref(asked)));
        } catch (const std::system_error &) {
            // No more threads are available; the running ones take over all tops.
        }
        try {
            movers[0]->go(asked);
        } catch (...) {
            if (shared) shared->stopped = true;
            throw;
        }
        if (shared && waiting.is_over()) shared->stopped = true; // progress raises only once
        const auto a_while = std::chrono::milliseconds(5);
        for (auto &other : others) {
            do {
                if (patience::poll(&waiting)) shared->stopped = true;
            } while (other.wait_for(a_while) == std::future_status::timeout);
        }
        for (auto &other : others) other.get();
    }

  public:
    worker(const std::optional<std::string> &name, double step, double tol, int digits,
           int64_t max_steps, bool leave_heading,
           const std::vector<std::tuple<std::string, size_t, int>> &asked,
           std::shared_ptr<work> with)
        : method(name ? method_of(*name) : nullptr),
          config{step, tol, max_steps, nullptr, nullptr, digits, leave_heading, 0},
          shared(std::move(with))
    {
        for (const auto &[quantity, component, kind] : asked)
            kept.push_back({quantity_of(quantity), component, kr_reduce(kind)});
        movers.push_back(std::make_unique<mover>(method, config, kept, shared));
    }
    size_t width() const { return kept.size(); }
    // Returns the name of the lanes' instruction set, or "" without lanes, and the order of the
    // series.
    py::tuple kernel() const
    {
        int order = 0;
        const char *name = kr_worker_kernel(movers[0]->of_core(), &order);
        return py::make_tuple(name, order);
    }

    // Runs a task. Returns the failed rows and their last valid states.
    py::tuple run(const task &asked)
    {
        patience &waiting = movers[0]->waiting;
        waiting.begin();
        while (shared && movers.size() < shared->threads) { // each mover holds a Python object
            movers.push_back(std::make_unique<mover>(method, config, kept, shared));
            movers.back()->waiting.watching.signals = watch::theirs;
        }
        {
            py::gil_scoped_release nogil;
            go(asked);
        }
        waiting.end();
        std::vector<kr_state> last;
        std::vector<int64_t> failed;
        for (auto &one : movers) {
            last.insert(last.end(), one->last.begin(), one->last.end());
            failed.insert(failed.end(), one->failed.begin(), one->failed.end());
        }
        return py::make_tuple(py::array_t<int64_t>(py::ssize_t(failed.size()), failed.data()),
                              array_of_states(last));
    }
};

static py::tuple run(worker &mover, const tops &all, size_t begin, size_t end, const doubles &t,
                     const py::object &status, const py::object &done, const py::object &counts,
                     const py::object &reached, const py::object &states, const py::object &reduced,
                     const py::dict &columns)
{
    check_range(all, begin, end, t);
    const size_t n = end - begin, times = size_t(t.shape(t.ndim() - 1));
    const results to = results_of(n, times, status, done, counts, reached, states, reduced,
                                  mover.width(), columns);
    kr_tops these = {};
    these.times = times;
    these.t = t.data();
    these.own_times = t.ndim() == 2;
    return mover.run({all, begin, n, these, to, nullptr});
}
// Computes sections: for each top, n states at which an event occurs, each within the given time
// after the last.
static py::tuple section(worker &mover, const tops &all, size_t begin, size_t end,
                         const py::list &event, size_t n, const doubles &wait,
                         const py::object &status, const py::object &done, const py::object &counts,
                         const py::object &reached, const py::object &states)
{
    if (begin > end || end > all.size() || size_t(wait.size()) != end - begin)
        throw py::value_error("there are other tops or times than these");
    const results to = results_of(end - begin, n, status, done, counts, reached, states, py::none(),
                                  mover.width(), py::dict());
    looked_for sought;
    sought.take(event);
    if (sought.events.size() != 1) throw py::value_error("a section is that of one event");
    kr_tops these = {};
    these.times = n;
    these.t = wait.data();
    these.own_times = 1;
    return mover.run({all, begin, end - begin, these, to, sought.events.data()});
}

// Computes the growth of one tangent for each of the tops begin to end, at times common to all
// tops. Writes rows of KR_GROWTH_COUNT numbers, NaN after a failure. The direction has six numbers
// or is empty.
static void growth(const tops &all, size_t begin, size_t end, const doubles &t, double tol,
                   int64_t max_steps, const std::vector<double> &direction,
                   const py::object &status, const py::object &out, std::shared_ptr<work> with)
{
    check_range(all, begin, end, t);
    const size_t n = end - begin, most = 512, times = size_t(t.size());
    auto *codes = in_place<int8_t>(status, n);
    double *to = in_place<double>(out, n * times * KR_GROWTH_COUNT);
    patience waiting;
    waiting.shared = std::move(with);
    const kr_config config = {0.0,      tol, max_steps, patience::poll,
                              &waiting, 0,   1,         KR_TANGENT_GROWTH};
    kr_worker *made = nullptr;
    if (kr_worker_create(method_of("taylor"), config, 0, nullptr, &made) != KR_OK)
        throw std::bad_alloc();
    const std::unique_ptr<kr_worker, void (*)(kr_worker *)> core(made, kr_worker_free);
    waiting.begin();
    {
        py::gil_scoped_release nogil;
        std::vector<kr_scene> scenes(std::min(n, most));
        std::vector<kr_outcome> outcomes(scenes.size());
        for (size_t at = 0, count; at < n && !waiting.is_over(); at += count) {
            count = std::min(most, n - at);
            all.fill(begin + at, begin + at + count, scenes.data());
            kr_tops these = {};
            these.n = count;
            these.scenes = scenes.data();
            these.times = times;
            these.t = t.data();
            these.outcomes = outcomes.data();
            these.growth = to + at * times * KR_GROWTH_COUNT;
            these.direction = direction.size() == 6 ? direction.data() : nullptr;
            kr_worker_run(core.get(), &these);
            for (size_t i = 0; i < count; i++) codes[at + i] = int8_t(outcomes[i].status);
            waiting.did(int64_t(count));
        }
    }
    waiting.end();
}

// Writes a quantity at the states of all tops, an array (tops, times, 8) in C order, given the
// number of valid states of each top.
static void values_of_tops(const std::string &name, const tops &all, const doubles &states,
                           const py::array_t<int64_t, py::array::c_style> &done,
                           const py::object &out)
{
    const kr_quantity *quantity = quantity_of(name);
    const size_t n = all.size(), width = quantity->doubles,
                 times = n > 0 ? size_t(states.size()) / (8 * n) : 0;
    if (size_t(states.size()) != 8 * n * times || size_t(done.size()) != n)
        throw py::value_error("an array has the wrong shape");
    double *to = in_place<double>(out, n * times * width);
    const auto *from = reinterpret_cast<const kr_state *>(states.data());
    const int64_t *good = done.data();
    in_pieces(py::ssize_t(n * times), [&](py::ssize_t begin, py::ssize_t end) {
        for (size_t i = size_t(begin); i < size_t(end);) {
            const size_t top = i / times, k = i % times,
                         count = std::min(size_t(end) - i, times - k), most = size_t(good[top]);
            kr_scene scene;
            all.fill(top, top + 1, &scene);
            take_values(quantity, scene, count, most > k ? most - k : 0, from + i, to + i * width);
            i += count;
        }
    });
}
// Writes the derivatives of a quantity at the states of all tops, given the tangents there. The
// other arguments are those of values_of_tops.
static void derivatives_of_tops(const std::string &name, const tops &all, const doubles &states,
                                const py::array_t<int64_t, py::array::c_style> &done, uint64_t by,
                                const doubles &tangents, const py::object &out)
{
    const kr_quantity *quantity = quantity_of(name);
    const size_t n = all.size(), times = n > 0 ? size_t(states.size()) / (8 * n) : 0,
                 columns = kr_tangent_columns(by), wide = 6 * columns,
                 width = columns * (name == "q" ? 3 : quantity->doubles);
    if (size_t(states.size()) != 8 * n * times || size_t(done.size()) != n ||
        size_t(tangents.size()) != n * times * wide)
        throw py::value_error("an array has the wrong shape");
    double *to = in_place<double>(out, n * times * width);
    const auto *from = reinterpret_cast<const kr_state *>(states.data());
    const double *moved = tangents.data();
    const int64_t *good = done.data();
    in_pieces(py::ssize_t(n), [&](py::ssize_t begin, py::ssize_t end) {
        for (size_t i = size_t(begin); i < size_t(end); i++) {
            const size_t first = i * times, count = size_t(good[i]);
            kr_scene scene;
            all.fill(i, i + 1, &scene);
            kr_quantity_tangents(quantity, &scene, count, from + first, by, moved + first * wide,
                                 to + first * width);
            std::fill(to + (first + count) * width, to + (first + times) * width, NAN);
        }
    });
}
// Returns true if a scene has neither damping nor friction, and its support is at rest.
static bool is_undisturbed(const kr_scene &scene)
{
    const kr_vec3 d = scene.damping, u = scene.turning;
    return d.x == 0.0 && d.y == 0.0 && d.z == 0.0 && u.x == 0.0 && u.y == 0.0 && u.z == 0.0 &&
           scene.shaking.amplitude == 0.0 && scene.friction == 0.0;
}
// Returns true if the method supports a scene with this body and environment. Without gravity, the
// answer does not depend on the start.
static bool suits_some_start(const kr_method *method, const kr_scene &scene)
{
    if (scene.gravity == 0.0 || !(kr_method_describe(method).flags & KR_METHOD_INTEGRABLE))
        return kr_method_suits(method, &scene);
    if (!is_undisturbed(scene)) return kr_method_suits(method, &scene);
    return kr_method_applies(method, &scene.body);
}
// Returns the index of the first top that the method does not support, and the number of such tops.
// Starts are not checked. The method exact, which depends on the start, reports the starts without
// a closed form when it runs.
static py::tuple unsuited(const tops &all, const std::string &name)
{
    const bool chosen = name == "auto";
    const kr_method *method = method_of(chosen ? "exact" : name);
    size_t first = all.size(), count = 0;
    kr_scene suited = {};
    bool found = false;
    const auto is_like = [&](const kr_scene &scene) {
        return found && scene.gravity == suited.gravity &&
               std::memcmp(&scene.body, &suited.body, sizeof scene.body) == 0 &&
               std::memcmp(&scene.damping, &suited.damping,
                           sizeof scene - offsetof(kr_scene, damping)) == 0;
    };
    const size_t n = all.size();
    in_pieces(py::ssize_t(n), [&](py::ssize_t begin, py::ssize_t end) {
        for (size_t i = size_t(begin); i < size_t(end); i++) {
            if (found && all.differ_in_starts_alone()) return;
            kr_scene scene;
            all.fill(i, i + 1, &scene);
            if (is_like(scene)) continue;
            if (suits_some_start(method, scene) && !(chosen && has_torus(scene))) {
                suited = scene;
                found = true;
            } else if (count++ == 0)
                first = i;
        }
    });
    return py::make_tuple(first, count);
}

// Writes the horizon of each top.
static void horizons(const tops &all, const py::object &out)
{
    double *to = in_place<double>(out, all.size());
    in_pieces(py::ssize_t(all.size()), [&](py::ssize_t begin, py::ssize_t end) {
        for (size_t i = size_t(begin); i < size_t(end); i++) {
            kr_scene scene;
            all.fill(i, i + 1, &scene);
            to[i] = kr_scene_horizon(&scene);
        }
    });
}

void bind_worker(py::module_ &m);
void bind_worker(py::module_ &m)
{
    py::list kinds;
#define X(kind, name) kinds.append(name);
    KR_REDUCE_LIST(X)
#undef X
    m.attr("reductions") = kinds;
    py::class_<work, std::shared_ptr<work>>(m, "Work")
        .def(py::init([] { return std::make_shared<work>(); }))
        .def(
            "listen",
            [](work &shared, size_t tops, const py::object &progress) {
                shared.listens = true;
                shared.tops = tops;
                shared.progress = progress;
            },
            "tops"_a, "progress"_a)
        .def("end",
             [](work &shared) {
                 const auto raised = std::move(shared.raised);
                 if (raised) throw *raised;
             })
        .def(
            "share", [](work &shared, size_t threads) { shared.threads = threads; }, "threads"_a)
        .def("stop", [](work &shared) { shared.stopped = true; })
        .def(
            "did",
            [](work &shared, int64_t tops) {
                shared.done += tops;
                if (!shared.listens || !shared.is_due()) return;
                shared.told = work::clock::now();
                shared.progress(shared.share());
            },
            "tops"_a)
        .def_property_readonly("stopped", [](const work &shared) { return shared.stopped.load(); })
        .def_property_readonly("done", [](const work &shared) { return shared.done.load(); });
    py::class_<worker>(m, "Worker")
        .def(py::init<std::optional<std::string>, double, double, int, int64_t, bool,
                      std::vector<std::tuple<std::string, size_t, int>>, std::shared_ptr<work>>(),
             "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a, "leave_heading"_a,
             "reductions"_a, "work"_a = nullptr)
        .def_property_readonly("kernel", &worker::kernel)
        .def("run", run, "tops"_a, "begin"_a, "end"_a, "t"_a, "status"_a, "done"_a, "counts"_a,
             "reached"_a, "states"_a = py::none(), "reduced"_a = py::none(),
             "columns"_a = py::dict())
        .def("section", section, "tops"_a, "begin"_a, "end"_a, "event"_a, "n"_a, "wait"_a,
             "status"_a, "done"_a, "counts"_a, "reached"_a, "states"_a);
    m.def("growth", growth, "tops"_a, "begin"_a, "end"_a, "t"_a, "tol"_a, "max_steps"_a,
          "direction"_a, "status"_a, "out"_a, "work"_a = nullptr);
    m.def("values_of_tops", values_of_tops, "name"_a, "tops"_a, "states"_a, "done"_a, "out"_a);
    m.def("derivatives_of_tops", derivatives_of_tops, "name"_a, "tops"_a, "states"_a, "done"_a,
          "by"_a, "tangents"_a, "out"_a);
    m.def("horizons", horizons, "tops"_a, "out"_a);
    m.def("unsuited", unsuited, "tops"_a, "method"_a);
}
