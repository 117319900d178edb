/* Arithmetic for templates. A template is a header that is compiled for doubles and again, with
 * KR_DEEP defined, for double-doubles (dd.h); source files include real.h before each inclusion.
 * `real` is the type of numbers, and `real_vec` of vectors. REAL(f) is plain_f or deep_f, and
 * VEC(f) is v_f or vdd_f (su2.h, su2_dd.h). r_of(hi, lo) is hi + lo as a `real` (hi for doubles),
 * r_dd(a) converts a `dd` to a `real`, and r_vdd(a) a `vec_dd` to a `real_vec`. r_get(from, member)
 * and r_put(to, member, a) load and store a `real_vec` in an array of structs: the doubles `hi` are
 * in [0].member and, with KR_DEEP, the doubles `lo` in [1].member. */
#undef real
#undef real_vec
#undef REAL
#undef VEC
#undef r_of
#undef r_high
#undef r_low
#undef r_add
#undef r_sub
#undef r_mul
#undef r_div
#undef r_dd
#undef r_vdd
#undef r_get
#undef r_put
#if defined KR_DEEP
#  define real dd
#  define real_vec vec_dd
#  define REAL(name) deep_##name
#  define VEC(name) vdd_##name
#  define r_of(hi, lo) dd_make((double)(hi), (lo))
#  define r_high(a) ((a).hi)
#  define r_low(a) ((a).lo)
#  define r_add dd_add
#  define r_sub dd_sub
#  define r_mul dd_mul
#  define r_div dd_div
#  define r_dd(a) (a)
#  define r_vdd(a) (a)
#  define r_get(from, member) vdd_load((from)[0].member, (from)[1].member)
#  define r_put(to, member, a)                                                                     \
      (v_put((to)[0].member, vdd_high(a)), v_put((to)[1].member, vdd_low(a)))
#else
#  define real double
#  define real_vec kr_vec3
#  define REAL(name) plain_##name
#  define VEC(name) v_##name
#  define r_of(hi, lo) ((double)(hi))
#  define r_high(a) (a)
#  define r_low(a) 0.0
#  define r_add(a, b) ((a) + (b))
#  define r_sub(a, b) ((a) - (b))
#  define r_mul(a, b) ((a) * (b))
#  define r_div(a, b) ((a) / (b))
#  define r_dd(a) ((a).hi)
#  define r_vdd(a) vdd_high(a)
#  define r_get(from, member) v_of((from)[0].member)
#  define r_put(to, member, a) v_put((to)[0].member, a)
#endif
