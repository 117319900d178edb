/* Writes the rotation of a tumbling cuboid, 1 m x 0.6 m x 0.2 m and 1 kg, at 60 steps a second.
 *
 * The columns are the time [s], the attitude and the angular velocity in the body [1/s]. The
 * argument 2 or 4 is the order of the step. */
#include <kreisel_step.h>
#include <stdio.h>
#include <stdlib.h>

int main(int count, char **words)
{
    const int order = count > 1 ? atoi(words[1]) : 2;
    const double moments[3] = {0.1 / 3, 0.26 / 3, 0.34 / 3}, h = 1.0 / 60; /* [kg m^2], [s] */
    const double velocity[3] = {3, 1, 2};                                  /* [1/s] */
    double q[4] = {1, 0, 0, 0}, m[3];
    kr_step_momentum(moments, q, velocity, m);
    printf("t,qw,qx,qy,qz,wx,wy,wz\n");
    for (int i = 0; i <= 600; i++) {
        double w[3], body[3];
        kr_step_velocity(moments, q, m, w);
        kr_step_rotate(q, -1, w, body);
        printf("%.17g,%.17g,%.17g,%.17g,%.17g,", i * h, q[0], q[1], q[2], q[3]);
        printf("%.17g,%.17g,%.17g\n", body[0], body[1], body[2]);
        kr_step(moments, q, m, NULL, h, order);
    }
    return 0;
}
