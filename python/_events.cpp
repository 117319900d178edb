// Runs that look for events. An event comes from Python as (terms, where, extremum, direction,
// most, terminal), a term as (factor, of, times) with numbers from `components`.
#include <vector>
#include "watch.hpp"

using terms = std::vector<kr_term>;
static terms terms_of(const py::handle &list)
{
    terms all;
    for (const py::handle &item : list) {
        const auto [factor, of, times] = item.cast<std::tuple<double, int, int>>();
        all.push_back({factor, of, times});
    }
    return all;
}

struct watched {
    std::vector<terms> functions;
    std::vector<kr_event> events;
    std::vector<int64_t> most, found;
    std::vector<bool> terminal;

    explicit watched(const py::list &list)
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
            events[i].where = where.data(), events[i].where_count = where.size();
        }
    }
    // Whether it is one of those asked for; `last` if the path ends there.
    bool counts(size_t i, bool &last)
    {
        if (most[i] && found[i] == most[i]) return false;
        ++found[i];
        last = terminal[i] && (!most[i] || found[i] == most[i]);
        return true;
    }
};

struct journal {
    std::vector<kr_state> states, low;
    std::vector<int> which, direction;

    void add(const kr_top *top)
    {
        states.push_back(kr_top_state(top));
        low.push_back(kr_top_low(top));
    }
};
static doubles array_of_states(const std::vector<kr_state> &states)
{
    doubles out({py::ssize_t(states.size()), py::ssize_t(8)});
    if (!states.empty())
        std::memcpy(out.mutable_data(), states.data(), states.size() * sizeof(kr_state));
    return out;
}
static py::tuple numbers_of(const journal &events)
{
    return py::make_tuple(
        array_of_states(events.states), array_of_states(events.low),
        py::array_t<int>(py::ssize_t(events.which.size()), events.which.data()),
        py::array_t<int>(py::ssize_t(events.direction.size()), events.direction.data()));
}

static kr_status follow(kr_top *top, const double *t, size_t n, watched &wanted, journal &path,
                        journal &events)
{
    kr_status status = KR_OK;
    bool last = false;
    for (size_t i = 0; i < n && status == KR_OK && !last; i++) {
        kr_hit hit;
        while ((status = kr_top_seek(top, t[i], &hit)) == KR_OK && hit.which >= 0 && !last) {
            if (!wanted.counts(size_t(hit.which), last)) continue;
            events.add(top);
            events.which.push_back(int(hit.which));
            events.direction.push_back(hit.direction);
            if (last) break;
        }
        if (status == KR_OK || path.states.empty() || path.states.back().t != kr_top_state(top).t)
            path.add(top);
    }
    return status;
}
static py::tuple record_events(const kr_scene &scene, const std::string &method, double step,
                               double tol, int digits, int64_t max_steps, const doubles &t,
                               const py::list &list, const py::object &progress)
{
    watched wanted(list);
    journal path, events;
    watch watching;
    const bool back = t.size() > 0 && t.data()[t.size() - 1] < 0.0;
    const kr_config config = {led(step, back), tol,    max_steps, watch::poll,
                              &watching,       digits, false};
    kr_top *raw = nullptr;
    kr_stats stats = {0, 0, 0, 0};
    kr_status status = kr_top_create(&scene, method_of(method), config, &raw);
    const std::unique_ptr<kr_top, void (*)(kr_top *)> top(raw, kr_top_free);
    watching.top = raw;
    watching.begin(progress);
    if (status == KR_OK) status = kr_top_watch(raw, wanted.events.size(), wanted.events.data());
    if (status == KR_OK) {
        const double *times = t.data();
        const size_t n = size_t(t.size());
        py::gil_scoped_release nogil;
        status = follow(raw, times, n, wanted, path, events);
        stats = kr_top_stats(raw);
    } else {
        path.states.push_back(scene.start);
        path.low.push_back(kr_state());
    }
    if (watching.raised && !watching.raised->matches(PyExc_KeyboardInterrupt))
        throw *watching.raised;
    return py::make_tuple(name_of(status), array_of_states(path.states), array_of_states(path.low),
                          counts(stats), numbers_of(events));
}
static doubles terms_value(const kr_scene &scene, const doubles &states, const py::list &list)
{
    if (states.ndim() != 2 || states.shape(1) != 8)
        throw py::value_error("an array has the wrong shape");
    const kr_state *in = reinterpret_cast<const kr_state *>(states.data());
    const terms g = terms_of(list);
    doubles out(states.shape(0));
    double *to = out.mutable_data();
    in_pieces(states.shape(0), [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) to[i] = kr_terms_value(&scene, &in[i], g.size(), g.data());
    });
    return out;
}

static py::dict components()
{
    py::dict table("1"_a = int(KR_ONE));
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        for (size_t k = 0; kr_quantity_flags(quantity) & KR_SERIES && kr_quantity_axis(quantity, k);
             k++) {
            const std::string name =
                std::string(kr_quantity_name(quantity)) + kr_quantity_axis(quantity, k);
            table[name.c_str()] = kr_component_find(name.c_str());
        }
    }
    return table;
}

void bind_events(py::module_ &m);
void bind_events(py::module_ &m)
{
    m.attr("components") = components();
    m.def("record_events", record_events, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a,
          "max_steps"_a, "t"_a, "events"_a, "progress"_a = py::none());
    m.def("terms_value", terms_value, "scene"_a, "states"_a, "terms"_a);
}
