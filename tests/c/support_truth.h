/* States of tops on moving supports, q and m as high and low words, from dm/dt and dq/dt of
 * kreisel.h in space. They were computed with mpmath in 45 digits by the extrapolation of Gragg,
 * Bulirsch and Stoer, whose last two results agree to 37 digits. */
#ifndef KR_TEST_SUPPORT_TRUTH_H
#define KR_TEST_SUPPORT_TRUTH_H

enum { TURNING = 1, SHAKING = 2, OTHERS = 4 /* damping, a rotor, and a start at t = 0.25 */ };
static const struct {
    int kind;
    double t, high[7], low[7];
} support_truth[] = {
    {TURNING,
     1.5,
     {0x1.62452958d9a2cp-2, 0x1.8cb59db58970dp-1, -0x1.2f92ea2f4b2b3p-2, 0x1.c0c61ffab6181p-2,
      0x1.a5599abbb1b72p+0, 0x1.1f61d98c274c0p-3, 0x1.0e3c351b41636p+0},
     {-0x1.b5cf4b91083b0p-56, -0x1.b6fd0a4d33464p-57, -0x1.30e512e335e19p-57,
      -0x1.6c5337c09ed77p-57, 0x1.e665e31db434dp-55, -0x1.73e210e4a9a9ap-60,
      -0x1.c1cb9cf6bca41p-54}},
    {TURNING,
     -1.0,
     {0x1.0dbdbd3a07a14p-1, 0x1.f735f04285243p-2, -0x1.48633e1e98a00p-1, 0x1.0e1c6bdbe1e63p-2,
      0x1.2d4508289712bp-5, -0x1.d8cc0fec8b30fp-1, 0x1.4372936aecec2p+0},
     {0x1.495070ae2a4d7p-56, -0x1.affe38b28816bp-58, -0x1.f4657f94d9659p-55, -0x1.7be325afce74cp-56,
      0x1.e401e2d2c4385p-59, -0x1.ab93b6619e76ep-57, -0x1.9dca597651904p-54}},
    {SHAKING,
     1.5,
     {-0x1.becb3db16ca06p-3, 0x1.bea5422f00716p-1, -0x1.87d23e53be054p-4, 0x1.b52800e6354c7p-2,
      0x1.18d82c8c2c78ap+0, 0x1.79997e5e56695p-1, 0x1.8000000000000p+0},
     {0x1.88e355df940b7p-57, 0x1.bb5636d553747p-57, -0x1.9d8f9bc12a4dfp-59, -0x1.925f8fba12418p-56,
      0x1.bba61e65fb2efp-54, 0x1.93d541c2c8877p-57, 0x0.0p+0}},
    {SHAKING,
     -1.0,
     {0x1.8dcb50ff119a9p-1, 0x1.9d5747de422e0p-7, -0x1.2c77b61251c87p-1, 0x1.d2279f83ede77p-3,
      0x1.070c98b299395p-2, 0x1.4301926cb89e2p-2, 0x1.8000000000000p+0},
     {0x1.eba6dd5d1db99p-55, -0x1.23fa47d08592cp-63, -0x1.a602ea441e932p-57, 0x1.45bd3b6f92790p-57,
      0x1.d311e643374bfp-56, -0x1.f577fb0685a7ap-60, 0x0.0p+0}},
    {TURNING | SHAKING | OTHERS,
     1.5,
     {0x1.d252a9b912ce0p-2, 0x1.7d7985a0803edp-1, -0x1.3a76d4197a2b2p-2, 0x1.837a744d60a00p-2,
      0x1.eba29fa5b6a92p+0, -0x1.b472b9f8a32f5p-2, 0x1.d263a78805b19p-1},
     {0x1.575f0d63b879cp-56, -0x1.1f2d8a8c91a30p-58, -0x1.6631f01ac24bcp-58, -0x1.bc55b6d26c938p-56,
      0x1.bc050c9d7190dp-54, -0x1.7ebb273e13defp-56, 0x1.121eba26d93e8p-55}},
    {TURNING | SHAKING | OTHERS,
     -1.0,
     {0x1.59e29df73ea66p-2, 0x1.cbd5329058074p-2, -0x1.828afb2678386p-1, 0x1.5a2abe43e84eep-2,
      -0x1.e97def99d4930p-3, -0x1.205493566e0e4p-1, 0x1.8cd45bb4ca10fp+0},
     {-0x1.ad45714818eb0p-57, 0x1.5f022dcaad6c0p-56, 0x1.2fcd3df9de13fp-57, -0x1.5608d69155fa5p-57,
      0x1.d29c00032a8fep-57, 0x1.c67a959a42da0p-55, 0x1.b9322258db075p-54}},
};
#endif
