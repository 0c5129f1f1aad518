// The states that a body keeps side by side, where it keeps two: service/fervor/session/lanes.py says why and when.
#ifndef FERVOR_BENCH_STATES_H
#define FERVOR_BENCH_STATES_H

#include <stdbool.h>

#include "network.h"

enum { MOST_STATES = 2, HALF = 120, FADE = 15 };  // steps at 30 Hz: half a state's life, and its cross-fade

struct person {
  uint64_t steps;
  int round;  // in which it last took one
  struct body states[MOST_STATES];
};

// Whether a state runs in a step; the second one starts half a life after the first.
static inline bool runs(uint64_t index, int state) { return state == 0 || index >= HALF; }

// Whether it is zero before it.
static inline bool restarts(uint64_t index, int state) { return index % (2 * HALF) == (uint64_t)state * HALF; }

// Its share of the estimate: the older one speaks, and hands over as it ends.
static inline float share(uint64_t index, int state) {
  if (index < HALF) return state == 0;
  int elder = index % (2 * HALF) >= HALF ? 0 : 1, until_restart = HALF - index % HALF;
  float younger = until_restart > FADE ? 0 : (float)(FADE + 1 - until_restart) / (FADE + 1);
  return state == elder ? 1 - younger : younger;
}

#endif
