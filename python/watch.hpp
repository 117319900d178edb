// Interruption and progress of runs: Ctrl-C, and reports of the time reached.
#pragma once
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include "arrays.hpp"

inline bool in_main_thread()
{
    static const py::handle main_thread =
        py::object(py::module_::import("threading").attr("main_thread")).release();
    return main_thread().attr("ident").cast<unsigned long>() == PyThread_get_thread_ident();
}

// State shared by the calls that run the tops of an ensemble. Another thread may stop these calls.
// If `listens` is set, there is no separate waiting thread: the calling thread itself checks
// signals and calls `progress`, and an exception from either stops all calls.
struct work {
    using clock = std::chrono::steady_clock;
    std::atomic<bool> stopped{false};
    std::atomic<int64_t> done{0}; // tops
    bool listens = false;
    py::object progress = py::none();
    clock::time_point looked = clock::now(), told = looked; // last check, last call of progress
    std::unique_ptr<py::error_already_set> raised;
    // Threads take parts of the remaining tops. The parts become smaller and smaller, so that all
    // threads end at about the same time. With 0 threads each call has its own range.
    size_t threads = 0, tops = 0;
    std::atomic<size_t> next{0};

    bool is_due() const
    {
        return !progress.is_none() && clock::now() - told >= std::chrono::milliseconds(100);
    }
    double share() const { return double(done) / double(tops); }

    bool take(size_t most, size_t &begin, size_t &count)
    {
        constexpr size_t least = 32, share = 4;
        begin = next.load();
        do {
            if (begin >= tops) return false;
            count = std::max(least, (tops - begin) / (share * threads));
            count = std::min({count, most, tops - begin});
        } while (!next.compare_exchange_weak(begin, begin + count));
        return true;
    }
};

// The poll function of the core. Acquiring the GIL costs time, so it is acquired only at intervals.
// Only the main thread may run Python's signal handlers; the first check determines whether this is
// the main thread.
struct watch {
    using clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds longest{100}; // between calls of progress
    const kr_top *top = nullptr;
    double end = 0.0; // the last requested time; a step of the top may end after it
    py::object progress = py::none();
    std::shared_ptr<work> shared; // used instead of progress
    work *counted = nullptr;      // progress is called with the share of this work
    enum { unknown, ours, theirs } signals = unknown; // who handles them: ours in the main thread
    // times of the last check and the last call of progress, for the whole run
    clock::time_point looked = clock::now(), told = looked;
    std::unique_ptr<py::error_already_set> raised;

    void begin(const py::object &callback)
    {
        shared = py::isinstance<work>(callback) ? callback.cast<std::shared_ptr<work>>() : nullptr;
        progress = shared ? py::none() : callback;
        signals = unknown;
        raised.reset();
    }
    // Starts to watch for `all`. Calls the progress function of `all` from now on if `all` listens.
    void begin(work &all)
    {
        begin(all.listens ? all.progress : py::none());
        counted = &all;
    }
    double time_reached() const
    {
        const double time = kr_top_describe(top).time;
        return std::fabs(time) < std::fabs(end) ? time : end;
    }
    void look()
    {
        const bool due = counted ? !progress.is_none() && counted->is_due()
                                 : !progress.is_none() && looked - told >= longest;
        if (signals == theirs && !due) return;
        py::gil_scoped_acquire gil;
        try {
            if (signals == unknown) signals = in_main_thread() ? ours : theirs;
            if (signals == ours && PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (due) progress(counted ? counted->share() : time_reached());
        } catch (py::error_already_set &error) {
            raised = std::make_unique<py::error_already_set>(std::move(error));
        }
        if (due) (counted ? counted->told : told) = clock::now();
    }
    static int poll(void *context)
    {
        auto *self = static_cast<watch *>(context);
        if (self->shared && self->shared->stopped) return 1;
        const auto now = clock::now();
        auto &looked = self->counted ? self->counted->looked : self->looked;
        if (now - looked < std::chrono::milliseconds(10)) return 0;
        looked = now;
        self->look();
        return self->raised != nullptr;
    }
};

// Returns the step for a direction of time. With the step 0 a method chooses its own step forward
// in time; backward in time it begins with -0.1.
inline double led(double step, bool back) { return !back ? step : step > 0.0 ? -step : -0.1; }
inline py::tuple counts(const kr_stats &s)
{
    return py::make_tuple(s.steps, s.rejected, s.evaluations, s.iterations);
}
