/* Hashes and scenes for the programs that compare with stored results. */
#ifndef KR_BITS_H
#define KR_BITS_H
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "kreisel.h"

/* Returns the FNV-1a hash of the bytes of doubles, the lowest byte of each double first, so that
 * the same numbers have the same hash on every machine. */
static inline uint64_t hash_of(const void *doubles, size_t size)
{
    uint64_t h = 14695981039346656037u, word;
    for (size_t i = 0; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, (const unsigned char *)doubles + i, sizeof word);
        for (int byte = 0; byte < 8; byte++, word >>= 8) h = (h ^ (word & 255)) * 1099511628211u;
    }
    return h;
}
/* Returns the top of the thesis, or a variant: with a fast spin, with a general body, or
 * hanging. */
static inline kr_scene golden_scene(int which)
{
    kr_scene s = kr_scene_default();
    const double tensor[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    const kr_vec3 com = {0.25, -0.5, 0.75};
    s.start.q = (kr_quat){0.5, 0.5, -0.5, 0.5};
    if (which == 1) s.start.m.z = 200.0;
    if (which == 2) kr_body_from_tensor(2.0, tensor, com, 0.0, &s.body);
    if (which == 3) s.gravity = -10.0;
    return s;
}
static const char *const golden_names[] = {"thesis", "fast", "general", "hanging"};
#endif
