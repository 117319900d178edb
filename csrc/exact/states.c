/* Many states of a plan: blocks of times, as wide as the processor is. Floor 3. Compiled with the tree vectorizer; no
 * variant may fuse a product and a sum, hence none asks for FMA. */
#include "kernel.h"

enum { BLOCK = 64 };
typedef struct block {
    double t[BLOCK], w[BLOCK], x[BLOCK], y[BLOCK], z[BLOCK], mx[BLOCK], my[BLOCK], mz[BLOCK];
} block;

INLINE void fill(const kr_exact *e, int hyperbolic, int even, block *b)
{
    for (int i = 0; i < BLOCK; i++) {
        const kr_state s = kernel(e, hyperbolic, even, two_sum(b->t[i], -e->begin));
        b->w[i] = s.q.w, b->x[i] = s.q.x, b->y[i] = s.q.y, b->z[i] = s.q.z;
        b->mx[i] = s.m.x, b->my[i] = s.m.y, b->mz[i] = s.m.z;
    }
}
INLINE void frame(const kr_exact *e, block *b)
{
    for (int i = 0; i < BLOCK; i++) {
        const kr_quat q = {b->w[i], b->x[i], b->y[i], b->z[i]}, r = q_mul(q_mul(e->left, q), e->right);
        b->w[i] = r.w, b->x[i] = r.x, b->y[i] = r.y, b->z[i] = r.z;
    }
}
INLINE void any(const kr_exact *plan, block *b)
{
    const kr_exact e = *plan;                           /* a copy that no store can change */
    switch (e.curve) {
    case CIRCULAR_COSINE: fill(&e, 0, 0, b); break;
    case CIRCULAR_EVEN: fill(&e, 0, 1, b); break;
    case HYPERBOLIC_COSINE: fill(&e, 1, 0, b); break;
    default: fill(&e, 1, 1, b); break;
    }
    if (e.framed) frame(&e, b);
}
static void plain(const kr_exact *e, block *b) { any(e, b); }

#if defined __x86_64__ && defined __GNUC__
__attribute__((target("avx2"))) static void avx2(const kr_exact *e, block *b) { any(e, b); }
__attribute__((target("avx512f"))) static void avx512(const kr_exact *e, block *b) { any(e, b); }

typedef void kernel_of(const kr_exact *, block *);
static kernel_of *widest(void)
{
    if (__builtin_cpu_supports("avx512f")) return avx512;
    return __builtin_cpu_supports("avx2") ? avx2 : plain;
}
#else
#  define widest() plain
#endif

/* Whole blocks, so that the loops above have a fixed length; what lies beyond n is computed and dropped. */
void kr_exact_states(const kr_exact *e, size_t n, const double t[], kr_state out[])
{
    block b = {.t = {0.0}};
    for (size_t from = 0; from < n; from += BLOCK) {
        const size_t count = n - from < BLOCK ? n - from : BLOCK;
        memcpy(b.t, t + from, count * sizeof b.t[0]);
        widest()(e, &b);
        for (size_t i = 0; i < count; i++) {
            const kr_state s = {b.t[i], {b.w[i], b.x[i], b.y[i], b.z[i]}, {b.mx[i], b.my[i], b.mz[i]}};
            out[from + i] = s;
        }
    }
}
