/* The closed form of a Lagrange top or of a free body, and the states computed from it. Let
 * q = (w, x, y, z) be the attitude, m the angular momentum in space (e3 points up),
 * alpha = w + i z and beta = x + i y. K and K' are the complete elliptic integrals of a modulus k
 * (lagrange.h, symmetric.c) and of k' = sqrt(1 - k^2). The theta functions have the nome
 * exp(-pi K'/K). X(t) = X0 + nu t is the phase of the nutation [rad]; y1, y2, c1, c2, k1 and k2 are
 * constants. Up to constant factors and the common denominator theta4(X),
 *     alpha ~ theta1(X + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(X + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(X + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)}
 * (Klein and Sommerfeld, Theorie des Kreisels). The "phases" of alpha and beta are c1 + k1 t and
 * c2 + k2 t, without the arguments of theta1 and theta2. For a torque-free body with three distinct
 * moments (Jacobi; the flag `euler`), m is constant, the nome is exp(-2 pi K'/K), y1 = y2, k1 = k2,
 * theta4 replaces theta2, and the denominator differs. It cancels when q is normalized. Jacobi's
 * transformation replaces a nome p > exp(-pi) by the smaller dual nome exp(pi^2 / ln p) (the flag
 * `dual`). Errors of states do not grow: all quantities that grow with time are double-doubles.
 *
 * This header is compiled for each instruction set, both with and without KR_EXACT_LANES. With
 * KR_EXACT_LANES, each number is a vector with one lane per top (math/simd.h). The result in each
 * lane is bitwise equal to that of the scalar code. If lanes take different branches, both branches
 * are computed, and each lane selects its own result. Loops leave finished lanes unchanged. */
#ifndef KR_EXACT_KERNEL_H
#define KR_EXACT_KERNEL_H

#if defined KR_EXACT_LANES
#  define KR_DD_LANES
#else
#  define KR_ONE_LANE
#endif
#include "exact.h"
#include "model/scene.h"
#include "math/dd.h"
#include "math/simd.h"
#include "math/su2.h"

/* The kinds of theta series, as stored in kr_exact_form.curve. EULER: `euler`; _DUAL: `dual`. */
enum { LAGRANGE, EULER, LAGRANGE_DUAL, EULER_DUAL };

/* Vector versions of the types in kreisel.h and exact.h, with one lane per top. */
#if defined KR_EXACT_LANES
typedef struct vec3_lanes {
    wide x, y, z;
} vec3_lanes;
typedef struct quat_lanes {
    wide w, x, y, z;
} quat_lanes;
typedef struct state_lanes {
    wide t;
    quat_lanes q;
    vec3_lanes m;
} state_lanes;
typedef struct theta_lanes {
    wide even[KR_THETA_TERMS], odd[KR_THETA_TERMS];
} theta_lanes;
typedef struct phase_lanes {
    wide fast, slow, start, more;
} phase_lanes;
/* The vector version of kr_exact_form, without the members `framed` and `frame`. */
typedef struct exact_lanes {
    wide period, precession_rate, spin_angle_rate, begin, curve;
    phase_lanes nutation, first, second;
    wide stretch, stretch_rest, slope[2];
    theta_lanes alpha, beta, horizontal;
    wide momentum, side;
    vec3_lanes constant;
} exact_lanes;
/* Only heavy tops are processed in vector lanes. */
INLINE int uses_euler_series(const exact_lanes *e) { return (void)e, 0; }
INLINE mask uses_dual_nome(const exact_lanes *e)
{
    return wide_equal(e->curve, wide_splat(LAGRANGE_DUAL));
}
#else
typedef kr_vec3 vec3_lanes;
typedef kr_quat quat_lanes;
typedef kr_state state_lanes;
typedef kr_theta theta_lanes;
typedef kr_phase phase_lanes;
typedef kr_exact_form exact_lanes;
INLINE int uses_euler_series(const kr_exact_form *e)
{
    return e->curve == EULER || e->curve == EULER_DUAL;
}
INLINE mask uses_dual_nome(const kr_exact_form *e)
{
    return e->curve == LAGRANGE_DUAL || e->curve == EULER_DUAL;
}
#endif
/* Copies the `selected` lanes of `from` to `to`, and leaves the other lanes of `to` unchanged. Both
 * arguments point to structures of `bytes` bytes, whose members are all SIMD vectors. */
INLINE void copy_selected_lanes(void *to, const void *from, size_t bytes, mask selected)
{
    for (size_t at = 0; at < bytes; at += sizeof(wide)) {
        wide *old = (wide *)(void *)((char *)to + at);
        *old = wide_choose(selected, *(const wide *)(const void *)((const char *)from + at), *old);
    }
}

/* In internal units (method.h), the largest of momentum, rotor momentum and |lever| (exact_top) is
 * about one. |lever| < LEAST_LEVER counts as zero: it has no effect in the times permitted by
 * is_span_computable. Momenta below LEAST_MOMENTUM count as zero: their squares underflow. */
#define LEAST_LEVER 1e-100
#define LEAST_MOMENTUM 1e-160

/* A top and its initial state, in internal axes and units (method.h). */
typedef struct exact_top {
    vec3_lanes inertia;
    dd q[4];  /* the attitude, which need not be of unit length */
    dd lever; /* mass * gravity * com along T */
    vec3_lanes m;
} exact_top;

INLINE mask wide_more(wide a, wide b) { return wide_less(b, a); }
INLINE mask is_negative(wide a) { return wide_less(a, wide_splat(0.0)); }
INLINE mask is_positive(wide a) { return wide_less(wide_splat(0.0), a); }
INLINE wide sign_from_mask(mask negative)
{
    return wide_choose(negative, wide_splat(-1.0), wide_splat(1.0));
}
INLINE wide length(wide x, wide y) { return wide_sqrt(x * x + y * y); }
INLINE wide drop_tiny_momentum(wide m)
{
    return wide_choose(wide_less(wide_abs(m), wide_splat(LEAST_MOMENTUM)), wide_splat(0.0), m);
}

static inline int is_identity(kr_quat q) { return v_largest(q_vec(q)) == 0.0; }
/* Returns the image of q under the linear map f, given the images f[0] .. f[3] of 1, i, j and k.
 * kr_exact_form.frame is such a map: it converts the q of the closed form to kr_state.q. */
INLINE kr_quat apply_quaternion_map(const kr_quat f[4], kr_quat q)
{
    return q4((q.w * f[0].w + q.x * f[1].w) + (q.y * f[2].w + q.z * f[3].w),
              v3((q.w * f[0].x + q.x * f[1].x) + (q.y * f[2].x + q.z * f[3].x),
                 (q.w * f[0].y + q.x * f[1].y) + (q.y * f[2].y + q.z * f[3].y),
                 (q.w * f[0].z + q.x * f[1].z) + (q.y * f[2].z + q.z * f[3].z)));
}
/* Writes the linear map q -> left * q * right to `frame`. */
static inline void set_left_right_map(kr_quat frame[4], kr_quat left, kr_quat right)
{
    const double w = left.w, x = left.x, y = left.y, z = left.z;
    const kr_quat columns[4] = {left, {-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    for (int i = 0; i < 4; i++) frame[i] = q_mul(columns[i], right);
}
/* Writes the linear map q -> -i q: attitudes are turned about e1 by half a turn. */
static inline void set_up_down_map(kr_quat frame[4])
{
    set_left_right_map(frame, q4(0.0, v3(-1.0, 0.0, 0.0)), q_one());
}
/* Replaces the linear map f in `frame` (the identity, if `is_set` is 0) by q -> f(q) * conj(axes).
 * `axes` rotates from the internal axes to the frame of description (kreisel.h). */
static inline void multiply_map_by_inverse_axes(kr_quat frame[4], int is_set, kr_quat axes)
{
    if (!is_set) set_left_right_map(frame, q_one(), q_one());
    for (int i = 0; i < 4; i++) frame[i] = q_mul(frame[i], q_conj(axes));
}

/* Returns the integer nearest to x, |x| < 2^51. Adding 1.5 * 2^52 leaves no fraction bits. */
INLINE wide nearest(wide x)
{
    const double shift = 6755399441055744.0;
    return (x + shift) - shift;
}
/* Returns the value of a phase [turns] at the time t after the initial time, minus a whole number
 * of turns. The high word is between 0 and 2. two_sum_ordered is exact: f->start is 0 (make_phase)
 * or at least 1/2 (set_initial_phase), and |p.hi - nearest(p.hi)| <= 1/2. The result is not
 * normalized: if the phase has changed by nearly 2^50 turns, the low word may reach 1/4. */
INLINE dd evaluate_phase(const phase_lanes *f, dd t)
{
    const dd p = two_product(t.hi, f->fast), s = two_sum_ordered(f->start, p.hi - nearest(p.hi));
    return dd_make(s.hi, ((p.lo + f->more) + (t.hi * f->slow + t.lo * f->fast)) + s.lo);
}
/* Returns x + extra. The result is not necessarily a normalized double-double. */
INLINE dd phase_plus(dd x, wide extra)
{
    const dd s = two_sum(x.hi, extra);
    return dd_make(s.hi, s.lo + x.lo);
}
INLINE dd turns_per_radian(void)
{
    return dd_make(wide_splat(0.15915494309189534561), wide_splat(-9.839338337591243e-18));
}
/* Writes the sine s and cosine c of an angle of x turns, |x| < 2^49. The sum u = x + shift is
 * between 2^50 and 2^51, where doubles are multiples of 1/4. The two lowest bits of u are the
 * nearest number of quarter turns, modulo 4. The remainder |y| is at most an eighth of a turn. */
INLINE void sincos_turns(dd x, wide *s, wide *c)
{
    const double shift = 1688849860263936.0;
    const wide u = (x.hi + x.lo) + shift, y = (x.hi - (u - shift)) + x.lo;
    const wide z = y * y, zz = z * z;
    const wide odd = (-41.341702240399755 + z * 81.6052492760517) +
                     zz * ((-76.70585973561397 + z * 42.05868917945876) +
                           zz * (-15.094054064726203 + z * 3.786430011879243));
    const wide even =
        (-19.739208802178716 + z * 64.93939402266824) +
        zz * ((-85.45681720664378 + z * 60.24464135269435) +
              zz * ((-26.426253274804587 + z * 7.903206845861561) + zz * -1.6990328650055457));
    const wide sine = y * 6.283185307179586 + y * (2.4492935982947064e-16 + z * odd),
               cosine = 1.0 + z * even;
    const wide_integer quarter = wide_bits(u),
                       swap = (wide_bits(sine) ^ wide_bits(cosine)) & (0 - (quarter & 1));
    *s = wide_of_bits((wide_bits(sine) ^ swap) ^ ((quarter & 2) << 62));
    *c = wide_of_bits((wide_bits(cosine) ^ swap) ^ (((quarter + 1) & 2) << 62));
}
/* The factors of exp(a) = 2^k (cosh r + sinh r) and exp(-a) = 2^-k (cosh r - sinh r), |a| < 708,
 * where k is the integer nearest to a / ln 2, and a = r + k ln 2. Then |k| < 1022. */
typedef struct exponential {
    wide plus, minus; /* 2^k, 2^-k */
    wide even, odd;   /* cosh r, sinh r */
} exponential;
INLINE exponential split_exponential(dd a)
{
    const double shift = 6755399441055744.0;
    const wide up = a.hi * 1.44269504088896340736 + shift, k = up - shift;
    const wide r = (a.hi - k * 0.693147180369123816490) - (k * 1.90821492927058770002e-10 - a.lo),
               rr = r * r;
    const uint64_t one = 0x3ff0000000000000u;
    exponential e;
    e.odd =
        r + r * rr *
                (1.0 / 6 +
                 rr * (1.0 / 120 +
                       rr * (1.0 / 5040 + rr * (1.0 / 362880 + rr * (1.0 / 39916800 +
                                                                     rr * (1.0 / 6227020800.0))))));
    e.even =
        1.0 +
        rr * (0.5 + rr * (1.0 / 24 +
                          rr * (1.0 / 720 + rr * (1.0 / 40320 + rr * (1.0 / 3628800 +
                                                                      rr * (1.0 / 479001600.0))))));
    e.plus = wide_of_bits((wide_bits(up) << 52) + one);
    e.minus = wide_of_bits((wide_bits(shift - k) << 52) + one);
    return e;
}
INLINE void sinhcosh(dd a, wide *s, wide *c)
{
    const exponential e = split_exponential(a);
    const wide plus = e.plus * (e.even + e.odd), minus = e.minus * (e.even - e.odd);
    *s = 0.5 * (plus - minus);
    *c = 0.5 * (plus + minus);
}
/* evaluate_cubic and evaluate_quartic return the sum of a[n] s^n for n < 4 or 5; ss is s^2. */
INLINE wide evaluate_cubic(const wide a[], wide s, wide ss)
{
    return (a[0] + s * a[1]) + ss * (a[2] + s * a[3]);
}
INLINE wide evaluate_quartic(const wide a[], wide s, wide ss)
{
    return (a[0] + s * a[1]) + ss * ((a[2] + s * a[3]) + ss * a[4]);
}

/* The results of evaluate_theta_series: real and imaginary parts of the theta functions in alpha
 * (a), beta (b) and m_x + i m_y (h), and the phases [turns] of alpha (first) and beta (second). */
typedef struct factors {
    wide a_re, a_im, b_re, b_im, h_re, h_im;
    dd first, second;
} factors;

/* Evaluates the theta series at the time t after the initial time. Let z be the phase of the
 * nutation in half turns, minus the nearest integer. If `dual` is nonzero, sinh and cosh of -z
 * e->stretch replace the sine and cosine, and Jacobi's transformation adds z * e->slope[0] turns to
 * the phase of alpha, and z * e->slope[1] turns to the phase of beta. */
INLINE factors evaluate_theta_series(const exact_lanes *e, int dual, int euler, dd t)
{
    const dd x = evaluate_phase(&e->nutation, t);
    wide s, c, sign = wide_splat(1.0), square, quartic;
    factors f;
    f.first = evaluate_phase(&e->first, t);
    f.second = evaluate_phase(&e->second, t);
    if (dual) {
        /* x is the phase of the nutation in turns, about 0 to 2. u = x + shift is a multiple of
         * 1/2. Its lowest bit is 1 if the number of half turns nearest to x is odd. |y| <= 1/4. */
        const double shift = 3377699720527872.0;
        const wide u = (x.hi + x.lo) + shift, near = x.hi - (u - shift), y = near + x.lo;
        const wide z = 2.0 * y, rest = 2.0 * ((near - y) + x.lo);
        const dd p = two_product(z, e->stretch);
        sinhcosh(dd_make(-p.hi, -(p.lo + (z * e->stretch_rest + rest * e->stretch))), &s, &c);
        f.first = phase_plus(f.first, z * e->slope[0]);
        f.second = phase_plus(f.second, z * e->slope[1]);
        /* theta1 and theta2 change sign after half a turn of the phase, which is one nutation. */
        sign = wide_of_bits(wide_bits(sign) ^ (wide_bits(u) << 63));
        square = -s * s;
    } else {
        sincos_turns(x, &s, &c);
        square = s * s;
    }
    quartic = square * square;
    f.a_re = sign * s * evaluate_cubic(e->alpha.even, square, quartic);
    f.a_im = sign * c * evaluate_cubic(e->alpha.odd, square, quartic);
    if (dual != euler) {
        f.b_re = sign * evaluate_quartic(e->beta.even, square, quartic);
        f.b_im = sign * s * c * evaluate_quartic(e->beta.odd, square, quartic);
    } else {
        f.b_re = c * evaluate_cubic(e->beta.even, square, quartic);
        f.b_im = s * evaluate_cubic(e->beta.odd, square, quartic);
    }
    f.h_re = evaluate_quartic(e->horizontal.even, square, quartic);
    f.h_im = s * c * evaluate_quartic(e->horizontal.odd, square, quartic);
    return f;
}
/* Returns the state at `time`, which is the initial time plus `span`. The caller must convert the
 * attitude by the linear map e->frame. If `euler` is nonzero, alpha and beta have equal phases. */
INLINE state_lanes evaluate_state(const exact_lanes *e, int dual, int euler, wide time, dd span)
{
    const factors f = evaluate_theta_series(e, dual, euler, span);
    const wide n =
        1.0 / wide_sqrt((f.a_re * f.a_re + f.a_im * f.a_im) + (f.b_re * f.b_re + f.b_im * f.b_im));
    wide s1, c1, s2, c2;
    sincos_turns(f.first, &s1, &c1);
    if (euler) {
        s2 = s1;
        c2 = c1;
    } else
        sincos_turns(f.second, &s2, &c2);
    const quat_lanes q = {n * (f.a_re * c1 - f.a_im * s1), n * (f.b_re * c2 - f.b_im * s2),
                          n * (f.b_re * s2 + f.b_im * c2), n * (f.a_re * s1 + f.a_im * c1)};
    /* Zero, or NaN if the attitude is NaN. Then the momentum must be NaN, too. */
    const wide none = q.w - q.w;
    vec3_lanes m = {e->constant.x - none, e->constant.y - none, e->constant.z - none};
    if (!euler) {
        const wide re = n * e->momentum * (c1 * c2 - s1 * s2),
                   im = n * e->momentum * (s1 * c2 + c1 * s2);
        m.x += f.h_re * re - f.h_im * im;
        m.y += e->side * (f.h_re * im + f.h_im * re);
    }
    return (state_lanes){time, q, m};
}

/* Bound on times: exact products of larger times may overflow without fused multiply-add. */
static const double longest = 0x1p990;
/* Returns 1 if the state at the time `span` after the initial time can be computed: |span| is less
 * than `longest`, and each phase changes by less than 2^50 turns in this time. */
INLINE mask is_span_computable(const exact_lanes *e, wide span)
{
    const wide most = wide_splat(0x1p50);
    return mask_and(mask_and(wide_less(wide_abs(span), wide_splat(longest)),
                             wide_less(wide_abs(span * e->nutation.fast), most)),
                    mask_and(wide_less(wide_abs(span * e->first.fast), most),
                             wide_less(wide_abs(span * e->second.fast), most)));
}
/* For the set-up: writes the real and imaginary parts of alpha, beta and m_x + i m_y at the time
 * `span` after the initial time, without the common denominator, the factor e->momentum and the
 * linear map e->frame. All lanes have the same kind of theta series (`dual`, `euler`). */
static inline void evaluate_alpha_beta_of_kind(const exact_lanes *e, int dual, int euler, wide span,
                                               wide out[6])
{
    const factors f = evaluate_theta_series(e, dual, euler, dd_of(span));
    wide s, c;
    sincos_turns(f.first, &s, &c);
    out[0] = f.a_re * c - f.a_im * s;
    out[1] = f.a_re * s + f.a_im * c;
    sincos_turns(f.second, &s, &c);
    out[2] = f.b_re * c - f.b_im * s;
    out[3] = f.b_re * s + f.b_im * c;
    sincos_turns(dd_add(f.first, f.second), &s, &c);
    out[4] = f.h_re * c - f.h_im * s;
    out[5] = f.h_re * s + f.h_im * c;
}
/* Writes the same as evaluate_alpha_beta_of_kind, for lanes with series of different kinds. */
static inline void evaluate_alpha_beta_momentum(const exact_lanes *e, double span, wide out[6])
{
    const mask dual = uses_dual_nome(e);
    const wide at = wide_splat(span);
    wide some[6];
    if (mask_all(dual)) {
        evaluate_alpha_beta_of_kind(e, 1, uses_euler_series(e), at, out);
        return;
    }
    evaluate_alpha_beta_of_kind(e, 0, uses_euler_series(e), at, out);
    if (!mask_any(dual)) return;
    evaluate_alpha_beta_of_kind(e, 1, uses_euler_series(e), at, some);
    copy_selected_lanes(out, some, sizeof some, dual);
}

static const double two_pi = 6.283185307179586477;
/* Returns a phase with the initial value zero and the given rate [rad per unit of time]. */
static inline phase_lanes make_phase(dd rate)
{
    const dd f = dd_mul(rate, turns_per_radian());
    return (phase_lanes){.fast = f.hi, .slow = f.lo};
}
/* Sets the initial value to `start` [turns] plus a whole number: a value from 1/2 to 3/2. */
static inline void set_initial_phase(phase_lanes *phase, dd start)
{
    const dd s = two_sum(wide_splat(1.0), start.hi - nearest(start.hi));
    phase->start = s.hi;
    phase->more = s.lo + start.lo;
}
/* Returns the arc tangent of u in turns, for |u| <= tan(pi/8), with an error of at most 1 ulp. */
static inline wide arc_tangent_in_turns(wide u)
{
    const dd turn = turns_per_radian();
    const wide z = u * u, zz = z * z;
    const wide low = (-0.0530516476972984402 + z * 0.0318309886183719381) +
                     zz * (-0.0227364204400317979 + z * 0.0176838824132084663);
    const wide high = (-0.0144686240078471209 + z * 0.0122424897797794527) +
                      zz * ((-0.0106068993999666122 + z * 0.00932353355566516922) +
                            zz * ((-0.00809374456969824621 + z * 0.00624391215077724649) +
                                  zz * -0.00305209614217111548));
    return u * turn.hi + u * (turn.lo + z * (low + zz * zz * high));
}
/* Returns the argument of x + i y in turns. */
static inline dd argument_in_turns(wide y, wide x)
{
    const wide ax = wide_abs(x), ay = wide_abs(y), zero = wide_splat(0.0);
    const mask flat = wide_at_most(ay, ax), left = is_negative(x), below = is_negative(y);
    /* After subtraction of quarter turns, the angle is the argument of a + i b with |b| <= a. */
    const wide a = wide_choose(flat, ax, ay),
               b = wide_choose(flat, wide_choose(left, -y, y), wide_choose(below, x, -x));
    const wide quarters =
        wide_choose(flat, wide_choose(left, wide_splat(0.5), zero), 0.25 * sign_from_mask(below));
    const wide up = sign_from_mask(is_negative(b));
    const mask far = wide_more(up * b, 0.41421356237309503 * a);
    const wide over = wide_choose(far, b - up * a, b), under = wide_choose(far, a + up * b, a);
    const wide eighth = wide_choose(far, 0.125 * up, zero);
    const wide tangent = wide_choose(is_positive(under), over / under, zero);
    return two_sum(quarters + eighth, arc_tangent_in_turns(tangent));
}
/* Returns the angle from the vector (x, y) to the vector (u, v), counterclockwise, in turns. */
static inline dd angle_between_in_turns(wide x, wide y, wide u, wide v)
{
    const dd re = dd_add(two_product(u, x), two_product(v, y)),
             im = dd_sub(two_product(v, x), two_product(u, y));
    return argument_in_turns(im.hi, re.hi);
}

static inline dd dot(const dd a[4], wide w, wide x, wide y, wide z)
{
    return dd_add(dd_add(dd_times(w, a[0]), dd_times(x, a[1])),
                  dd_add(dd_times(y, a[2]), dd_times(z, a[3])));
}
/* Replaces the quaternion q by the product q * by: the rotation `by` is applied first, then q. */
static inline void multiply_from_right(dd q[4], quat_lanes by)
{
    const dd a[4] = {q[0], q[1], q[2], q[3]};
    q[0] = dot(a, by.w, -by.x, -by.y, -by.z);
    q[1] = dot(a, by.x, by.w, by.z, -by.y);
    q[2] = dot(a, by.y, -by.z, by.w, by.x);
    q[3] = dot(a, by.z, by.y, -by.x, by.w);
}
/* Divides a quaternion by its norm, and returns it in double precision. */
static inline quat_lanes round_to_unit_quaternion(const dd q[4])
{
    const wide w = q[0].hi, x = q[1].hi, y = q[2].hi, z = q[3].hi,
               n = 1.0 / wide_sqrt(w * w + (x * x + y * y + z * z));
    return (quat_lanes){n * w, n * x, n * y, n * z};
}
/* Writes the axis a = q e3 q* / |q|^2 and 1 + u, where u = a.e3 is the height of a. Returns 1 - u.
 * 1 + u and 1 - u are computed from the quaternion, so that no digits are lost near u = -1 or 1. */
static inline dd find_axis_and_pole_distances(const dd q[4], dd a[3], dd *one_plus_u)
{
    const dd up = dd_add(dd_square(q[0]), dd_square(q[3])),
             side = dd_add(dd_square(q[1]), dd_square(q[2]));
    const dd scale = dd_div_fast(dd_splat(2.0), dd_add(up, side)), minus = dd_mul(scale, side);
    *one_plus_u = dd_mul(scale, up);
    a[0] = dd_mul(scale, dd_add(dd_mul(q[1], q[3]), dd_mul(q[0], q[2])));
    a[1] = dd_mul(scale, dd_sub(dd_mul(q[2], q[3]), dd_mul(q[0], q[1])));
    a[2] = dd_half(dd_sub(*one_plus_u, minus));
    return minus;
}
/* Writes q* v q / |q|^2 to r: the vector v of space, with components along the axes of the body. */
static inline void turn_back_dd(const dd q[4], const dd v[3], dd r[3])
{
    dd p[4][4];
    for (int i = 0; i < 4; i++)
        for (int j = 0; j <= i; j++) p[i][j] = p[j][i] = dd_mul(q[i], q[j]);
    const dd norm = dd_add(dd_add(p[0][0], p[1][1]), dd_add(p[2][2], p[3][3]));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3, a = i + 1, b = j + 1, c = k + 1;
        const dd along = dd_sub(dd_add(p[0][0], p[a][a]), dd_add(p[b][b], p[c][c]));
        const dd left = dd_twice(dd_add(p[a][b], p[0][c])),
                 right = dd_twice(dd_sub(p[a][c], p[0][b]));
        const dd turned =
            dd_add(dd_add(dd_mul(v[i], along), dd_mul(v[j], left)), dd_mul(v[k], right));
        r[i] = dd_div(turned, norm);
    }
}

static inline wide sign_of(wide x)
{
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    return wide_choose(is_positive(x), one, wide_choose(is_negative(x), -one, zero));
}

/* Sets the nutation period and the mean rates of precession and spin, from the rates nu, `first`
 * and `second` [rad per unit of time] of the phases of nutation, alpha and beta. While X grows by 2
 * pi, theta1(X + i y1) and theta2(X + i y2) circle zero once, clockwise for y > 0. This adds -nu
 * sign(y) to the mean rate of arg alpha or arg beta; exact->slope[0] or [1] has the sign of -y. For
 * y = 0 (real zeros), sign(y) is 0. theta4 (`euler`) does not circle zero. */
static inline void set_period_and_mean_rates(exact_lanes *exact, wide nu, wide first, wide second)
{
    const wide wind1 = sign_of(exact->slope[0]),
               wind2 = uses_euler_series(exact) ? wide_splat(0.0) : sign_of(exact->slope[1]);
    exact->period = 0.5 * two_pi / nu;
    exact->precession_rate = (first + second) + (wind1 + wind2) * nu;
    exact->spin_angle_rate = (first - second) + (wind1 - wind2) * nu;
}
/* Returns I1, the mean of the two principal moments about the axes normal to T, which are equal. */
static inline dd find_equatorial_moment(const exact_top *top)
{
    return dd_half(two_sum(top->inertia.x, top->inertia.y));
}
/* Returns the top after half a turn of attitude and momentum about e1, with reversed gravity. */
static inline exact_top exchange_up_and_down(const exact_top *top)
{
    exact_top r = *top;
    r.q[0] = dd_neg(top->q[1]);
    r.q[1] = top->q[0];
    r.q[2] = dd_neg(top->q[3]);
    r.q[3] = top->q[2];
    r.m.y = -top->m.y;
    r.m.z = -top->m.z;
    r.lever = dd_neg(top->lever);
    return r;
}
/* Undoes exchange_up_and_down in a closed form, except in e->frame (see set_up_down_map). */
static inline void undo_exchange_up_and_down(exact_lanes *exact)
{
    exact->side = wide_splat(-1.0);
    exact->constant.z = -exact->constant.z;
    exact->precession_rate = -exact->precession_rate;
}
/* Converts a closed form, except for exact->frame, from internal units to the user's units.
 * `begin`, `time_unit` and `momentum_unit` are the initial time and the internal units of time and
 * momentum, in the user's units. */
static inline void convert_form_to_user(exact_lanes *exact, wide begin, wide time_unit,
                                        wide momentum_unit)
{
    const wide rate = 1.0 / time_unit;
    phase_lanes *const phases[3] = {&exact->nutation, &exact->first, &exact->second};
    for (int i = 0; i < 3; i++) {
        phases[i]->fast = phases[i]->fast * rate;
        phases[i]->slow = phases[i]->slow * rate;
    }
    exact->begin = begin;
    exact->period = exact->period * time_unit;
    exact->precession_rate = exact->precession_rate * rate;
    exact->spin_angle_rate = exact->spin_angle_rate * rate;
    exact->momentum = exact->momentum * momentum_unit;
    exact->constant.x = momentum_unit * exact->constant.x;
    exact->constant.y = momentum_unit * exact->constant.y;
    exact->constant.z = momentum_unit * exact->constant.z;
}

#if !defined KR_EXACT_LANES
/* Returns the state at the time t, which is the initial time plus `span`. The compiler optimizes a
 * copy of evaluate_state for each kind of series, because `dual` and `euler` are constants. */
static inline kr_state compute_state_after_begin(const kr_exact_form *e, double t, dd span)
{
    kr_state r;
    if (e->curve == LAGRANGE)
        r = evaluate_state(e, 0, 0, t, span);
    else if (e->curve == EULER)
        r = evaluate_state(e, 0, 1, t, span);
    else if (e->curve == LAGRANGE_DUAL)
        r = evaluate_state(e, 1, 0, t, span);
    else
        r = evaluate_state(e, 1, 1, t, span);
    if (e->framed != 0.0) r.q = apply_quaternion_map(e->frame, r.q);
    return r;
}
/* Returns the state at the time t, or NaN if t is not finite. If t is finite but is_span_computable
 * returns 0, returns the initial attitude and momentum, whose integrals of motion are correct. */
static inline kr_state state_at(const kr_exact_form *e, double t)
{
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    const dd span = two_sum(t, -e->begin);
    if (is_span_computable(e, span.hi)) return compute_state_after_begin(e, t, span);
    return isfinite(t) ? compute_state_after_begin(e, t, dd_of(0.0)) : none;
}
#endif
#endif
