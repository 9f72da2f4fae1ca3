/* One control step of a sinew model: estimator, optimisation and limits together.

   There is one controller, at rest at the start. Nothing here is reentrant: call from one thread or
   one interrupt only. Values are in the model's own units; its scaling is inside.

   This is the controller alone. The supervisor of sinew's boards, which disarms after missed
   deadlines, errors that grow, stuck sensors and missing references, is not in it. */
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

/* The safe commands at once, without regard to the rate limit. Forgets the past, but not what a
   controller with a state has learned of the plant. It does not latch: the next step controls again. */
void sinew_mpc_emergency_stop(float *u_out);

/* Status of a step. From 3 to 8 nothing was optimised. */
enum {
    SINEW_CONVERGED = 0,
    SINEW_ITERATION_LIMIT = 1, /* the usual case */
    SINEW_NO_DECREASE = 2,
    SINEW_BAD_REFERENCE = 3,   /* the earlier plan is followed, however long that lasts */
    SINEW_BAD_SETTINGS = 4,
    SINEW_NOT_FINITE = 5,      /* the prediction, and the cost as well */
    SINEW_SIGNAL_LOST = 6,     /* going to the safe commands; also before the first step */
    SINEW_DISARMED = 7,        /* going to the safe commands, as asked */
    SINEW_OPEN_LOOP = 8,
    SINEW_CUT_SHORT = 9        /* optimised until the model's budget was used up */
};
uint32_t sinew_mpc_last_status(void);

/* Telemetry of the last step. */
struct sinew_mpc_telemetry {
    uint32_t status;     /* as sinew_mpc_last_status */
    uint32_t iterations; /* Newton iterations */
    float cost;          /* of the plan that is followed; 0 where nothing was optimised */
    uint32_t missed;     /* incomplete samples since the last reset */
};
void sinew_mpc_telemetry(struct sinew_mpc_telemetry *out);

/* Channels that are left out because the others contradict them: bit i is channel i, of the first 32.
   The others stand in, and nothing else changes. Always 0 of a model that watches none. */
uint32_t sinew_mpc_left_out(void);

/* How often one was left out since the last reset. */
uint32_t sinew_mpc_times_left_out(void);

/* The outputs as they are estimated; NaN while the signal is lost. */
void sinew_mpc_estimate(float *y_out);

/* The estimated disturbance, in the network's units. */
void sinew_mpc_disturbance(float *d_out);

/* Clears all state, the command applied last included: it is the safe one again. */
void sinew_reset(void);

#ifdef __cplusplus
}
#endif
#endif
