// Results of many tops, whose rows are written in place, and the interruption of their computation.
#pragma once
#include <pybind11/stl.h>
#include <cmath>
#include "events.hpp"
#include "tops.hpp"
#include "watch.hpp"

// A poll function for the core. It stops a run if the shared work is stopped or, without shared
// work, on a signal.
struct patience {
    std::shared_ptr<work> shared;
    watch watching;

    static int poll(void *context)
    {
        auto *self = static_cast<patience *>(context);
        if (!self->shared) return watch::poll(&self->watching);
        return self->shared->stopped || (self->shared->listens && watch::poll(&self->watching));
    }
    void begin()
    {
        if (shared)
            watching.begin(*shared);
        else
            watching.begin(py::none());
    }
    bool is_over() const { return (shared && shared->stopped) || watching.raised; }
    void did(int64_t tops)
    {
        if (shared) shared->done += tops;
    }
    void end()
    {
        auto raised = std::move(watching.raised);
        if (raised && !shared) throw *raised;
        if (!raised) return;
        shared->stopped = true;
        shared->raised = std::move(raised);
    }
};

inline const kr_quantity *quantity_of(const std::string &name)
{
    const kr_quantity *quantity = kr_quantity_find(name.c_str());
    if (!quantity) throw py::key_error(name);
    return quantity;
}
// Writes the values of a quantity at the first `done` of n states, and NaN at the others.
inline void take_values(const kr_quantity *quantity, const kr_scene &scene, size_t n, size_t done,
                        const kr_state *states, double *out)
{
    const size_t width = quantity->doubles, good = std::min(n, done);
    kr_quantity_values(quantity, &scene, good, states, out);
    std::fill(out + good * width, out + n * width, NAN);
}

// Arrays of the results, one row for each top; NULL if not requested.
struct results {
    struct column {
        const kr_quantity *quantity; // the quantity, or q or m if the low words are requested
        bool is_low;
        double *to;
    };
    int8_t *status;
    int64_t *done, *counts;
    double *reached, *reduced;
    kr_state *states, *low;
    double *tangents, *tangents_low, *truncation; // of tops that are computed one by one
    std::vector<column> columns;

    void take(size_t row, const kr_outcome &outcome) const
    {
        const kr_stats &s = outcome.stats;
        const int64_t counted[] = {s.steps, s.rejected, s.evaluations, s.iterations};
        status[row] = int8_t(outcome.status);
        done[row] = int64_t(outcome.done);
        reached[row] = outcome.last.t;
        std::copy(std::begin(counted), std::end(counted), counts + 4 * row);
    }
    // Sets the tangents of the states from `good` to n to NaN, `wide` numbers for each state.
    void clear_tangents(size_t row, size_t n, size_t good, size_t wide) const
    {
        const size_t first = (row * n + good) * wide, count = (n - good) * wide;
        if (tangents) std::fill_n(tangents + first, count, NAN);
        if (tangents_low) std::fill_n(tangents_low + first, count, NAN);
    }
    // Writes the requested results of n states, of which `good` are good. `rest` holds their low
    // words, or is NULL.
    void take_columns(size_t row, const kr_scene &scene, size_t n, size_t good,
                      const kr_state *these, const kr_state *rest) const
    {
        for (const column &c : columns) {
            const size_t width = c.quantity->doubles;
            double *to = c.to + row * n * width;
            if (c.is_low && !rest) {
                std::fill(to, to + good * width, 0.0);
                std::fill(to + good * width, to + n * width, NAN);
            } else {
                take_values(c.quantity, scene, n, good, c.is_low ? rest : these, to);
            }
        }
    }
};

// Checks that the range of tops exists, and that there is one row of times for all tops or one for
// each.
inline void check_range(const tops &all, size_t begin, size_t end, const doubles &t)
{
    if (t.ndim() == 0 || t.ndim() > 2 || begin > end || end > all.size() ||
        (t.ndim() == 2 && size_t(t.shape(0)) != end - begin))
        throw py::value_error("there are other tops or times than these");
}
inline results results_of(size_t n, size_t times, const py::object &status, const py::object &done,
                          const py::object &counts, const py::object &reached,
                          const py::object &states, const py::object &reduced, size_t width,
                          const py::dict &columns)
{
    results to = {};
    to.status = in_place<int8_t>(status, n);
    to.done = in_place<int64_t>(done, n);
    to.counts = in_place<int64_t>(counts, 4 * n);
    to.reached = in_place<double>(reached, n);
    if (!states.is_none())
        to.states = reinterpret_cast<kr_state *>(in_place<double>(states, 8 * n * times));
    if (!reduced.is_none()) to.reduced = in_place<double>(reduced, n * width);
    for (const auto &[key, array] : columns) {
        auto name = py::cast<std::string>(key);
        const bool is_low = name == "q_low" || name == "m_low";
        const kr_quantity *quantity = quantity_of(is_low ? name.substr(0, 1) : name);
        const size_t count = n * times * quantity->doubles;
        to.columns.push_back({quantity, is_low, in_place<double>(array, count)});
    }
    return to;
}
