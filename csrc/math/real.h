/* Arithmetic of a template that is compiled first for doubles and then for double-doubles. A source
 * includes this file before each inclusion of its template, the second time with KR_DEEP defined.
 * `real` is the type of a number, r_of(hi, lo) a number with these words, and REAL forms the names
 * of types and functions. r_put stores a number at the same place in two adjacent structs, of high
 * and of low words. Without KR_DEEP, low words are neither read nor stored. */
#undef real
#undef REAL
#undef r_of
#undef r_high
#undef r_low
#undef r_add
#undef r_sub
#undef r_mul
#undef r_div
#undef r_put
#if defined KR_DEEP
#  define real dd
#  define REAL(name) deep_##name
#  define r_of(hi, lo) dd_make((double)(hi), (lo))
#  define r_high(a) ((a).hi)
#  define r_low(a) ((a).lo)
#  define r_add dd_add
#  define r_sub dd_sub
#  define r_mul dd_mul
#  define r_div dd_div
#  define r_put(to, member, a) ((to)[0].member = (a).hi, (to)[1].member = (a).lo)
#else
#  define real double
#  define REAL(name) plain_##name
#  define r_of(hi, lo) ((double)(hi))
#  define r_high(a) (a)
#  define r_low(a) 0.0
#  define r_add(a, b) ((a) + (b))
#  define r_sub(a, b) ((a) - (b))
#  define r_mul(a, b) ((a) * (b))
#  define r_div(a, b) ((a) / (b))
#  define r_put(to, member, a) ((to)[0].member = (a))
#endif
