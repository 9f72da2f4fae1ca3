/* One control step of a sinew model: estimator, optimisation and limits together. Not reentrant. */
#ifndef SINEW_MPC_H
#define SINEW_MPC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* y_measured: the outputs, then the sensor channels, NaN where missing; reference: N2 rows of n_y, the first for
   the next sample; u_out: the commands, inside the limits whatever came in. The model's own units; its scaling
   is inside. A null y_measured is a missing sample, a null reference one that cannot be followed. */
void sinew_mpc_step(const float *y_measured, const float *reference, float *u_out);

/* 0 converged, 1 iteration limit, 2 no decrease, 3 bad reference, 4 bad settings, 5 prediction not finite,
   6 lost (also before the first step). */
uint32_t sinew_mpc_last_status(void);

/* Clears all state, the command applied last included: it is the safe one again. */
void sinew_reset(void);

#ifdef __cplusplus
}
#endif
#endif
