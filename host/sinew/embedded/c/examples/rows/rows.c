/* Reads rows of sensor values and prints the command of each: a controller in a pipe.

   A row holds the outputs, then the sensor channels, in the order of sinew_model.h; a value that is
   no number is missing. The arguments are the outputs that are asked for, constant over the
   horizon; without them 0. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "sinew_model.h"
#include "sinew_mpc.h"

static float y[SINEW_MPC_READINGS], reference[SINEW_MPC_ROWS][SINEW_MPC_OUTPUTS], u[SINEW_MPC_COMMANDS];

/* Reads a row; 0 at the end. */
static int read_row(void)
{
    char word[64];
    for (int i = 0; i < SINEW_MPC_READINGS; i++) {
        char *end;
        if (scanf("%63s", word) != 1)
            return 0;
        y[i] = strtof(word, &end);
        if (*end != '\0')
            y[i] = NAN;
    }
    return 1;
}

int main(int n, char **asked)
{
    if (n > 1 + SINEW_MPC_OUTPUTS)
        return fprintf(stderr, "rows: the outputs are %d, got %d\n", SINEW_MPC_OUTPUTS, n - 1), 2;
    for (int i = 0; i + 1 < n; i++) {
        char *end;
        float value = strtof(asked[i + 1], &end);
        if (end == asked[i + 1] || *end != '\0')
            return fprintf(stderr, "rows: expected a number, got \"%s\"\n", asked[i + 1]), 2;
        for (int row = 0; row < SINEW_MPC_ROWS; row++)
            reference[row][i] = value;
    }
    while (read_row()) {
        struct sinew_mpc_telemetry said;
        sinew_mpc_step(y, &reference[0][0], u);
        sinew_mpc_telemetry(&said);
        for (int i = 0; i < SINEW_MPC_COMMANDS; i++)
            printf("%.9g ", (double)u[i]);
        printf("%u %u %.9g\n", (unsigned)said.status, (unsigned)said.iterations, (double)said.cost);
        fflush(stdout);
    }
    return 0;
}
