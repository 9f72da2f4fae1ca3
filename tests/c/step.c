/* The control step as a C program sees it: archive and header, nothing else. Prints what it found, and "ok". */
#include <math.h>
#include <stdio.h>

#include "sinew_mpc.h"

enum { N = 10, NY = 3, NU = 2 };

static float y[NY], reference[N * NY], u[NU], before[NU];

/* One step; 0 where a command left its box or moved too fast (models/reference/problem.json). */
static int step(const float *measured, const float *wanted)
{
    sinew_mpc_step(measured, wanted, u);
    for (int i = 0; i < NU; i++) {
        if (!(fabs(u[i]) <= 0.9f) || !(fabs((double)u[i] - before[i]) <= 0.06f)) {
            printf("command %g after %g\n", u[i], before[i]);
            return 0;
        }
        before[i] = u[i];
    }
    return 1;
}

int main(void)
{
    if (sinew_mpc_last_status() != 6)
        return printf("not lost before the first sample: %u\n", sinew_mpc_last_status()), 1;
    for (int i = 0; i < N * NY; i++)
        reference[i] = 0.2f;
    float moved = 0;
    for (int k = 0; k < 50; k++) {
        if (!step(y, reference))
            return 1;
        moved += fabsf(u[0]);
        if (sinew_mpc_last_status() > 2)
            return printf("status %u at a sound request\n", sinew_mpc_last_status()), 1;
    }
    if (moved < 0.1f)
        return printf("no command moved\n"), 1;

    for (int i = 0; i < N * NY; i++)
        reference[i] = NAN;
    if (!step(y, reference) || sinew_mpc_last_status() != 3)
        return printf("a reference of NaN is status %u\n", sinew_mpc_last_status()), 1;
    if (!step(y, NULL) || sinew_mpc_last_status() != 3)
        return printf("no reference is status %u\n", sinew_mpc_last_status()), 1;
    for (int k = 0; k < 20; k++)
        if (!step(NULL, reference))
            return 1;
    if (sinew_mpc_last_status() != 6)
        return printf("20 missing samples are status %u\n", sinew_mpc_last_status()), 1;

    /* By hand: what is asked for, inside the limits; then the safe command at once. */
    const float asked[NU] = {5.0f, -5.0f};
    struct sinew_mpc_telemetry said;
    sinew_reset();
    before[0] = before[1] = 0;
    for (int k = 0; k < 40; k++) {
        sinew_mpc_open_loop(y, asked, u);
        if (!(fabs(u[0] - before[0]) <= 0.0601) || sinew_mpc_last_status() != 8)
            return printf("open loop to %g, status %u\n", u[0], sinew_mpc_last_status()), 1;
        before[0] = u[0];
    }
    sinew_mpc_telemetry(&said);
    if (u[0] != 0.9f || u[1] != -0.9f || said.status != 8 || said.iterations != 0 || said.missed != 0)
        return printf("open loop ended at %g, %g, %u missed\n", u[0], u[1], said.missed), 1;
    y[0] = 0.25f;
    sinew_mpc_open_loop(y, NULL, u);
    float estimate[NY] = {1, 1, 1}, disturbance[NY] = {NAN, NAN, NAN};
    sinew_mpc_estimate(estimate);
    sinew_mpc_disturbance(disturbance);
    if (sinew_mpc_left_out() != 0 || sinew_mpc_times_left_out() != 0)
        return puts("a channel is left out where there is none"), 1;
    if (sinew_mpc_last_status() != 7 || !(u[0] < 0.9f) || !isfinite(disturbance[0]) || estimate[0] != 0.25f)
        return printf("towards the safe command: %g, estimate %g\n", u[0], estimate[0]), 1;
    sinew_mpc_emergency_stop(u);
    if (u[0] != 0 || u[1] != 0 || sinew_mpc_last_status() != 6)
        return printf("emergency stop at %g, %g\n", u[0], u[1]), 1;
    y[0] = 0;

    sinew_reset();
    before[0] = before[1] = 0;
    for (int i = 0; i < N * NY; i++)
        reference[i] = i % 2 ? 1e30f : -INFINITY;
    y[0] = INFINITY;
    if (!step(y, reference))
        return 1;
    puts("ok");
    return 0;
}
