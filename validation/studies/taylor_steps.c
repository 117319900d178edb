/* Runs a number of steps of one Taylor kernel, with negligible other work. The kernel computes the
 * whole motion, the motion without the heading, or more digits. Usage: taylor_steps COUNT
 * whole|headless|digits ORDER. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "taylor/taylor.h"

int main(int argc, char **argv)
{
    static kr_series s[2];
    const double x[8] = {.6, 0, .8, 0, 0, -.96, 0, -.28}, w[4] = {0, .8, .4, .1},
                 k[4] = {0, -.28, .84, -.73}, up[4] = {0, -.02, .68, -.01},
                 down[4] = {0, .06, .01, -.64};
    if (argc < 4) return 2;
    const kr_isa *isa = kr_taylor_isa(0);
    const kr_kernel *kernel = !strcmp(argv[2], "whole")      ? isa->plain
                              : !strcmp(argv[2], "headless") ? isa->headless
                                                             : isa->deep;
    while (kernel->order != atoi(argv[3])) kernel++;
    memcpy(s->end_x, x, sizeof x);
    memcpy(s->end_w, w, sizeof w);
    memcpy(s->k, k, sizeof k);
    memcpy(s->up, up, sizeof up);
    memcpy(s->down, down, sizeof down);
    s->fall = s[1].fall = 100.0;
    for (int n = atoi(argv[1]); n > 0; n--) kernel->advance(s, -53.0, 1.0);
    printf("%s %a\n", isa->name, s->end_x[0]);
    return 0;
}
