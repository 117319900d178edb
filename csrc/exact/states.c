/* Many states of a plan: blocks of times, as wide as the instruction set is. Floor 3. Compiled with the vectorizer of
 * loops, once per instruction set: -DKR_SET=avx2 -mavx2 -mfma, and so on (CMakeLists.txt). */
#include "set.h"
#include "state.h"

enum { BLOCK = 64 };
typedef struct block {
    double t[BLOCK], w[BLOCK], x[BLOCK], y[BLOCK], z[BLOCK], mx[BLOCK], my[BLOCK], mz[BLOCK];
} block;

INLINE void fill(const kr_exact *e, int dual, int euler, block *b, int n)
{
    for (int i = 0; i < n; i++) {
        const kr_state s = kernel(e, dual, euler, b->t[i], two_sum(b->t[i], -e->begin));
        b->w[i] = s.q.w, b->x[i] = s.q.x, b->y[i] = s.q.y, b->z[i] = s.q.z;
        b->mx[i] = s.m.x, b->my[i] = s.m.y, b->mz[i] = s.m.z;
    }
}
INLINE void frame(const kr_exact *e, block *b, int n)
{
    for (int i = 0; i < n; i++) {
        const kr_quat r = framed(e->frame, q4(b->w[i], v3(b->x[i], b->y[i], b->z[i])));
        b->w[i] = r.w, b->x[i] = r.x, b->y[i] = r.y, b->z[i] = r.z;
    }
}
/* Eight arrays into states: a transposition. */
INLINE void write(const block *restrict b, int n, kr_state *restrict out)
{
    for (int i = 0; i < n; i++) {
        out[i].t = b->t[i];
        out[i].q.w = b->w[i], out[i].q.x = b->x[i], out[i].q.y = b->y[i], out[i].q.z = b->z[i];
        out[i].m.x = b->mx[i], out[i].m.y = b->my[i], out[i].m.z = b->mz[i];
    }
}
/* At most a block. Rounded up to eights, so that compilers need no loop for a rest. */
static void states(const kr_exact *plan, block *b, int count)
{
    const kr_exact e = *plan;                           /* a copy that no store can change */
    const int n = (count + 7) & ~7;
    switch (e.curve) {
    case LAGRANGE: fill(&e, 0, 0, b, n); break;
    case EULER: fill(&e, 0, 1, b, n); break;
    case LAGRANGE_DUAL: fill(&e, 1, 0, b, n); break;
    default: fill(&e, 1, 1, b, n); break;
    }
    if (e.framed) frame(&e, b, n);
}
void KR_NAME(kr_exact_many)(const kr_exact *e, size_t n, const double t[], kr_state out[])
{
    block b = {.t = {0.0}};
    for (size_t from = 0; from < n; from += BLOCK) {
        const int count = n - from < BLOCK ? (int)(n - from) : BLOCK;
        memcpy(b.t, t + from, (size_t)count * sizeof b.t[0]);
        states(e, &b, count);
        write(&b, count, out + from);
    }
}
