// Measured times.
#ifndef FERVOR_BENCH_SERIES_H
#define FERVOR_BENCH_SERIES_H

#include "websocket.h"

// Times that grow in number, kept as float microseconds.
struct series { float *values; size_t count, room; };

static inline void add(struct series *series, double seconds) {
  if (series->count == series->room) {
    series->room = series->room ? series->room * 2 : 65536;
    series->values = grown(series->values, series->room * sizeof(float));
  }
  series->values[series->count++] = seconds * 1e6;
}

static inline void write_series(FILE *file, const struct series *series) {
  uint64_t count = series->count;
  if (fwrite(&count, 8, 1, file) != 1 || fwrite(series->values, sizeof(float), count, file) != count) die("result");
}

#endif
