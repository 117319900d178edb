// Tops in motion: with the GIL released, Ctrl-C and progress looked after, and as checkpoints.
#include <atomic>
#include "watch.hpp"

// The states written, and the last good one where that is later: the first rows of an array, which is not copied.
static doubles reached(const doubles &out, size_t rows)
{
    return py::object(out[py::slice(0, py::ssize_t(rows), 1)]);
}

class run {
    watch watching;
    std::unique_ptr<kr_top, void (*)(kr_top *)> top{nullptr, kr_top_free};
    std::atomic<bool> busy{false};

    // One thread at a time; and not from within its own progress.
    struct turn {
        std::atomic<bool> &busy;
        explicit turn(std::atomic<bool> &flag) : busy(flag)
        {
            if (busy.exchange(true)) throw std::runtime_error("this run is under way: one thread at a time, one call in another");
        }
        ~turn() { busy = false; }
    };

public:
    kr_status start(const py::object &scene, const std::string &method, double step, double tol, int digits, int64_t max_steps,
                    bool leave_heading)
    {
        const auto s = value_of<kr_scene>(scene);
        kr_top *raw = nullptr;
        const kr_config config = {step, tol, max_steps, watch::poll, &watching, digits, leave_heading};
        const kr_status status = kr_top_create(&s, method_of(method), config, &raw);
        top.reset(raw);
        watching.top = raw;
        return status;
    }
    py::tuple record(const doubles &t, bool low_too, const py::object &progress)
    {
        const turn mine(busy);
        const size_t n = size_t(t.size());
        doubles out({t.size(), py::ssize_t(8)}), low({low_too ? t.size() : py::ssize_t(0), py::ssize_t(8)});
        const double *times = t.data();
        auto *states = reinterpret_cast<kr_state *>(out.mutable_data());
        auto *rest = low_too ? reinterpret_cast<kr_state *>(low.mutable_data()) : nullptr;
        size_t done = 0;
        kr_status status;
        watching.begin(progress);
        {
            py::gil_scoped_release nogil;
            status = kr_top_record_low(top.get(), n, times, states, rest, &done);
        }
        if (status == KR_OK && watch::poll(&watching)) status = KR_ERR_INTERRUPTED;
        watching.progress = py::none();
        if (watching.raised && !watching.raised->matches(PyExc_KeyboardInterrupt)) throw *watching.raised;
        if (status != KR_OK) {
            const kr_state last = kr_top_state(top.get());
            const bool more = done < n && (done == 0 || states[done - 1].t != last.t);
            if (more) states[done] = last;
            if (more && rest) rest[done] = kr_top_low(top.get());
            out = reached(out, done + more);
            if (rest) low = reached(low, done + more);
        }
        return py::make_tuple(name_of(status), out, rest ? py::object(low) : py::none(), counts(kr_top_stats(top.get())));
    }
    py::bytes save()
    {
        const turn mine(busy);
        std::string memory(kr_top_save_size(top.get()), '\0');
        kr_top_save(top.get(), memory.size(), &memory[0]);
        return memory;
    }
    const char *load(const std::string &memory)
    {
        const turn mine(busy);
        return name_of(kr_top_load(top.get(), memory.size(), memory.data()));
    }
    py::tuple kernel() const
    {
        int order = 0;
        const char *name = kr_top_kernel(top.get(), &order);
        return py::make_tuple(name, order);
    }
    double time() const { return kr_top_state(top.get()).t; }
};

static py::tuple start(const py::object &scene, const std::string &method, double step, double tol, int digits,
                       int64_t max_steps, bool leave_heading)
{
    auto made = std::make_unique<run>();
    const kr_status status = made->start(scene, method, step, tol, digits, max_steps, leave_heading);
    return py::make_tuple(name_of(status), status == KR_OK ? py::cast(std::move(made)) : py::none());
}
static py::tuple record(const py::object &scene, const std::string &method, double step, double tol, int digits,
                        int64_t max_steps, const doubles &t, bool leave_heading, const py::object &progress)
{
    run once;
    const kr_status status = once.start(scene, method, step, tol, digits, max_steps, leave_heading);
    if (status == KR_OK) return once.record(t, digits > 16, progress);
    doubles start({py::ssize_t(1), py::ssize_t(8)});
    const auto s = value_of<kr_scene>(scene);
    std::memcpy(start.mutable_data(), &s.start, sizeof s.start);
    return py::make_tuple(name_of(status), start, py::none(), py::make_tuple(0, 0, 0, 0));
}

void bind_run(py::module_ &m);
void bind_run(py::module_ &m)
{
    py::class_<run>(m, "Run")
        .def("record", &run::record, "t"_a, "low"_a, "progress"_a = py::none())
        .def("save", &run::save)
        .def("load", &run::load, "memory"_a)
        .def_property_readonly("kernel", &run::kernel)
        .def_property_readonly("t", &run::time);
    m.def("start", start, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a, "leave_heading"_a = false);
    m.def("record", record, "scene"_a, "method"_a, "step"_a, "tol"_a, "digits"_a, "max_steps"_a, "t"_a,
          "leave_heading"_a = false, "progress"_a = py::none());
}
