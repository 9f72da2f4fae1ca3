/* One control step of a sinew model: estimator, optimisation and limits together.

   There is one controller, at rest at the start. Nothing here is reentrant: call from one thread or
   one interrupt only. Values are in the model's own units; its scaling is inside. */
#ifndef SINEW_MPC_H
#define SINEW_MPC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One step. y_measured: the outputs, then the sensor channels, NaN where missing; reference: N2 rows
   of n_y, the first for the next sample; u_out: the commands, inside the limits whatever came in. A
   null y_measured is a missing sample, a null reference one that cannot be followed. */
void sinew_mpc_step(const float *y_measured, const float *reference, float *u_out);

/* One step without an optimisation: towards the commands u_asked, inside the limits, or towards the
   safe ones where it is null. The controller goes on estimating: a later step has no bump. */
void sinew_mpc_open_loop(const float *y_measured, const float *u_asked, float *u_out);

/* The safe commands at once, without regard to the rate limit. Clears all state. */
void sinew_mpc_emergency_stop(float *u_out);

/* 0 converged, 1 iteration limit, 2 no decrease, 3 bad reference, 4 bad settings, 5 prediction not
   finite, 6 lost (also before the first step), 7 to the safe commands, 8 open loop. */
uint32_t sinew_mpc_last_status(void);

/* Telemetry of the last step. */
struct sinew_mpc_telemetry {
    uint32_t status;     /* as sinew_mpc_last_status */
    uint32_t iterations; /* Newton iterations */
    float cost;          /* of the plan that is followed; 0 where nothing was optimised */
    uint32_t missed;     /* incomplete samples since the last reset */
};
void sinew_mpc_telemetry(struct sinew_mpc_telemetry *out);

/* The outputs as they are estimated. */
void sinew_mpc_estimate(float *y_out);

/* The estimated disturbance, in the network's units. */
void sinew_mpc_disturbance(float *d_out);

/* Clears all state, the command applied last included: it is the safe one again. */
void sinew_reset(void);

#ifdef __cplusplus
}
#endif
#endif
