/* exercise TOKEN STATES INDICATORS STEP INPUTS OUTPUTS PARAMETERS THREADS
 *
 * Lists are "REFERENCE:VALUES ..." with one blank between entries, "" when empty. Lives go through one after the other, then in as many
 * threads at once; exit code 1 and a message when a thread gets other bits. */
#include "exercise.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    pthread_t thread;
    const Model *model;
    unsigned seed;
    Digest digest;
} Life;

void insist(int good, const char *what)
{
    if (good)
        return;
    fprintf(stderr, "exercise: %s\n", what);
    exit(1);
}

void digest_add(Digest *digest, const double *values, size_t count)
{
    const unsigned char *bytes = (const unsigned char *)values;
    for (size_t i = 0; i < count * sizeof *values; i++)
        digest->hash = (digest->hash ^ bytes[i]) * 1099511628211ULL;
}

double input_value(unsigned seed, size_t i, int k)
{
    return (double)((seed * 7919u + (unsigned)i * 104729u + (unsigned)k * 31u) % 97u) / 97.0;
}

static List list(const char *text)
{
    List found = {0};
    while (*text != '\0') {
        char *rest;
        insist(found.count < MOST, "too many variables");
        found.reference[found.count++] = (unsigned)strtoul(text, &rest, 10);
        insist(*rest == ':', "a list of REFERENCE:VALUES is malformed");
        found.values += strtoul(rest + 1, &rest, 10);
        text = *rest == ' ' ? rest + 1 : rest;
    }
    insist(found.values <= MOST, "too many values");
    return found;
}

static void *live(void *argument)
{
    Life *life = argument;
    life->digest.hash = 14695981039346656037ULL;
    live_co_simulation(life->model, life->seed, &life->digest);
    live_model_exchange(life->model, life->seed, &life->digest);
    return NULL;
}

int main(int argc, char **argv)
{
    insist(argc == 9, "eight arguments, please");
    Model model = {argv[1],       strtoul(argv[2], NULL, 10), strtoul(argv[3], NULL, 10), strtod(argv[4], NULL),
                   list(argv[5]), list(argv[6]),              list(argv[7])};
    size_t threads = strtoul(argv[8], NULL, 10);
    Life *alone = calloc(threads + 1, sizeof *alone), *together = calloc(threads + 1, sizeof *together);
    insist(alone != NULL && together != NULL, "out of memory");
    for (size_t i = 0; i < threads; i++) {
        alone[i] = together[i] = (Life){.model = &model, .seed = (unsigned)i};
        live(&alone[i]);
    }
    for (size_t i = 0; i < threads; i++)
        insist(pthread_create(&together[i].thread, NULL, live, &together[i]) == 0, "no more threads");
    for (size_t i = 0; i < threads; i++)
        insist(pthread_join(together[i].thread, NULL) == 0, "a thread is lost");
    for (size_t i = 0; i < threads; i++) {
        insist(alone[i].digest.hash == together[i].digest.hash, "a thread among others gets other bits than alone");
        printf("%llx\n", alone[i].digest.hash);
    }
    free(alone);
    free(together);
    return 0;
}
