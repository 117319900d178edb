// States with their tangents, of a single top or of a top of an ensemble.
#pragma once
#include "arrays.hpp"

// Returns an array of zeros, whose memory the system provides only when it is written to.
inline doubles zeros(py::ssize_t n, py::ssize_t wide)
{
    return py::module_::import("numpy").attr("zeros")(py::make_tuple(n, wide));
}
// Where the states of a top and their tangents are written, `wide` numbers for each state. The low
// words may be null.
struct tangent_rows {
    size_t wide;
    kr_state *states, *low;
    double *high, *under;
};
// Records the states of a top at n times with their tangents, until one fails or `stops` returns
// true. Counts them in `done`.
template <class Stops>
kr_status follow_tangents(kr_top *top, size_t n, const double *t, const tangent_rows &to,
                          size_t &done, Stops stops)
{
    constexpr size_t between = 16; // states between two calls of `stops`
    kr_status came = KR_OK;
    for (; done < n && came == KR_OK; done += came == KR_OK) {
        kr_state *low = to.low ? to.low + done : nullptr;
        double *under = to.under ? to.under + done * to.wide : nullptr;
        came = kr_top_record(top, 1, t + done, to.states + done, low, nullptr);
        if (came == KR_OK) came = kr_top_tangents(top, to.high + done * to.wide, under);
        if (came == KR_OK && done % between == between - 1 && stops()) came = KR_ERR_INTERRUPTED;
    }
    return came;
}
