/* The true states of tests/truths.json. CMake writes its rows as truths.h, by truths.py. */
#ifndef KR_TEST_TRUTH_H
#define KR_TEST_TRUTH_H
#include "tops.h"

typedef struct truth {
    const char *name, *family;
    double tensor[9]; /* of a body that is not described in its principal axes, or zero */
    kr_scene scene;
    kr_state end, low; /* high and low words */
} truth;
static const truth truths[] = {
#include "truths.h"
};
enum { TRUTHS = sizeof truths / sizeof *truths };

static inline int belongs_to(const truth *row, const char *family)
{
    return strcmp(row->family, family) == 0;
}
static inline int is_tensor(const truth *row) { return row->tensor[0] > 0.0; }
static inline kr_scene scene_of_truth(const truth *row)
{
    kr_scene s = row->scene;
    if (!is_tensor(row)) return s;
    IS(kr_body_from_tensor(s.body.mass, row->tensor, row->scene.body.com, 0.0, &s.body) == KR_OK);
    kr_body_set_rotor(&s.body, row->scene.body.rotor);
    return s;
}
/* Returns the largest error of q, or of m in units of `size`. The sign of q counts. */
static inline double error_of_truth(const truth *row, kr_state at, kr_state low, double size)
{
    const kr_quat q = row->end.q, r = row->low.q;
    const double errors[4] = {(at.q.w - q.w) + (low.q.w - r.w), (at.q.x - q.x) + (low.q.x - r.x),
                              (at.q.y - q.y) + (low.q.y - r.y), (at.q.z - q.z) + (low.q.z - r.z)};
    double worst = v_length(v_add(v_sub(at.m, row->end.m), v_sub(low.m, row->low.m))) / size;
    for (int i = 0; i < 4; i++) worst = fmax(worst, fabs(errors[i]));
    return worst;
}
#endif
