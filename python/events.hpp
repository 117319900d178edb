// Events of a run: those requested and those found. Python passes an event as (terms, where,
// extremum, direction, most, terminal), and a term as (factor, of, times) with indices into the
// table `components`.
#pragma once
#include <vector>
#include "arrays.hpp"

using terms = std::vector<kr_term>;
inline terms terms_of(const py::handle &list)
{
    terms all;
    for (const py::handle &item : list) {
        const auto [factor, of, times] = item.cast<std::tuple<double, int, int>>();
        all.push_back({factor, of, times});
    }
    return all;
}

class looked_for
{
    std::vector<terms> functions;
    std::vector<int64_t> most;
    std::vector<bool> terminal;

    bool is_last(size_t i) const { return terminal[i] && found[i] && found[i] >= most[i]; }

  public:
    std::vector<kr_event> events;
    std::vector<int64_t> found; // number of occurrences of each event that have counted

    void take(const py::list &list)
    {
        for (const py::handle &item : list) {
            const auto e = item.cast<py::tuple>();
            functions.push_back(terms_of(e[0]));
            functions.push_back(terms_of(e[1]));
            kr_event event = {};
            event.extremum = e[2].cast<bool>();
            event.direction = e[3].cast<int>();
            events.push_back(event);
            most.push_back(e[4].cast<int64_t>());
            terminal.push_back(e[5].cast<bool>());
        }
        found.resize(events.size());
        for (size_t i = 0; i < events.size(); i++) {
            const terms &g = functions[2 * i], &where = functions[2 * i + 1];
            events[i].terms = g.data(), events[i].count = g.size();
            events[i].condition = where.data(), events[i].condition_count = where.size();
        }
    }
    // Counts an occurrence of event i. Returns false if the event has already been found as often
    // as requested.
    bool counts(size_t i)
    {
        if (most[i] && found[i] >= most[i]) return false;
        ++found[i];
        return true;
    }
    // Returns true if a terminal event has been found as often as requested.
    bool ended() const
    {
        for (size_t i = 0; i < events.size(); i++)
            if (is_last(i)) return true;
        return false;
    }
};

struct journal {
    std::vector<kr_state> states, low;
    std::vector<int> which, direction;

    void add(const kr_top *top)
    {
        states.push_back(kr_top_state(top));
        low.push_back(kr_top_describe(top).low);
    }
};
inline doubles array_of_states(const std::vector<kr_state> &states)
{
    doubles out({py::ssize_t(states.size()), py::ssize_t(8)});
    if (!states.empty())
        std::memcpy(out.mutable_data(), states.data(), states.size() * sizeof(kr_state));
    return out;
}
inline py::tuple numbers_of(const journal &events)
{
    return py::make_tuple(
        array_of_states(events.states), array_of_states(events.low),
        py::array_t<int>(py::ssize_t(events.which.size()), events.which.data()),
        py::array_t<int>(py::ssize_t(events.direction.size()), events.direction.data()));
}

// Advances to each of the times, and records the states and the events between them. Ends at the
// last requested occurrence of a terminal event.
template <class Stopped>
inline kr_status follow(kr_top *top, const double *t, size_t n, looked_for &wanted, journal &path,
                        journal &events, Stopped stopped)
{
    const size_t often = 1024; // number of states between two calls of `stopped`
    kr_status status = KR_OK;
    bool last = wanted.ended();
    for (size_t i = 0; i < n && status == KR_OK && !last; i++) {
        kr_event_hit hit = {-1, 0};
        if (i % often == often - 1 && stopped()) status = KR_ERR_INTERRUPTED;
        while (status == KR_OK && (status = kr_top_seek(top, t[i], &hit)) == KR_OK &&
               hit.index >= 0 && !last) {
            if (!wanted.counts(size_t(hit.index))) continue;
            events.add(top);
            events.which.push_back(int(hit.index));
            events.direction.push_back(hit.direction);
            last = wanted.ended();
            if (last) break;
        }
        if (status == KR_OK || path.states.empty() || path.states.back().t != kr_top_state(top).t)
            path.add(top);
    }
    return status;
}
