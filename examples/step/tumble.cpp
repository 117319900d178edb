// Prints the error of the attitude of a tumbling cuboid after 10 s, in single precision.
#include <kreisel_step.h>
#include <array>
#include <cmath>
#include <cstdio>

struct Body {
    std::array<float, 3> moments;  // about the principal axes [kg m^2]
    std::array<float, 4> attitude; // w, x, y, z; from the principal axes to space
    std::array<float, 3> momentum; // in space [kg m^2 / s]

    void step(float seconds)
    {
        kr_stepf(moments.data(), attitude.data(), momentum.data(), nullptr, seconds, 2);
    }
};

int main()
{
    Body body{{0.1f / 3, 0.26f / 3, 0.34f / 3}, {1, 0, 0, 0}, {}};
    const std::array<float, 3> velocity{3, 1, 2};
    kr_step_momentumf(body.moments.data(), body.attitude.data(), velocity.data(),
                      body.momentum.data());
    for (int i = 0; i < 600; i++) body.step(1.0f / 60);
    // The closed form
    const double truth[] = {-0.07100092, 0.42939487, 0.86647555, 0.24453840};
    double square = 0.0;
    for (unsigned i = 0; i < 4; i++)
        square += std::pow(static_cast<double>(body.attitude[i]) - truth[i], 2);
    std::printf("error after 10 s: %.1e rad\n", 2.0 * std::sqrt(square));
}
