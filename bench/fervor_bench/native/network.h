// The paper's network as plain arithmetic: features rot6d+velocity, two LSTMs, head. One step of up to ROWS bodies.
//
// The tables and weights come from the model file (floor.py writes them); the formulas are those of
// fervor_export/features.py and network.py. Every frame sees all joints: masks are no part of this floor.
#ifndef FERVOR_BENCH_NETWORK_H
#define FERVOR_BENCH_NETWORK_H

#include <math.h>
#include <stdint.h>

#include "websocket.h"

enum { JOINTS = 13, PER_JOINT = 10, FEATURES = JOINTS * PER_JOINT, HIDDEN1 = 64, HIDDEN2 = 128, EMOTIONS = 11 };
enum { ROWS = 64, TILE_ROWS = 4 };
#ifdef __AVX512F__
enum { LANES = 16 };
#else
enum { LANES = 8 };
#endif
enum { TILE = 2 * LANES };  // columns that one tile of registers holds
typedef float lanes __attribute__((vector_size(LANES * sizeof(float))));

enum { INPUT1 = FEATURES + HIDDEN1, INPUT2 = HIDDEN1 + HIDDEN2 };

struct body {
  float previous[JOINTS][4];  // unit quaternions of the frame before, xyzw; zero at first
  float h1[HIDDEN1], c1[HIDDEN1], h2[HIDDEN2], c2[HIDDEN2];
};

// As floor.py writes it; weights are [input, gate], gates in the order i o f c.
struct weights {
  float rate_scale;  // 2 * rate_hz * the feature's scale
  float lstm1[INPUT1][4 * HIDDEN1], bias1[4 * HIDDEN1];
  float lstm2[INPUT2][4 * HIDDEN2], bias2[4 * HIDDEN2];
  float head[EMOTIONS + 1][HIDDEN2], head_bias[EMOTIONS + 1];  // the emotions in order, then unknown
};

struct tiled {
  lanes *cells;  // [tile, input, 2]
  int inputs, columns;
};

static inline struct tiled tile(const float *weights, int inputs, int columns) {
  struct tiled made = {NULL, inputs, columns};
  if (posix_memalign((void **)&made.cells, 64, sizeof(float) * inputs * columns)) die("memory");
  float *to = (float *)made.cells;
  for (int first = 0; first < columns; first += TILE)
    for (int i = 0; i < inputs; i++)
      for (int c = 0; c < TILE; c++) *to++ = weights[i * columns + first + c];
  return made;
}

// out [rows, columns] = in [rows, inputs] x weights + bias; rows are a multiple of TILE_ROWS.
static inline void multiply(const struct tiled *weights, const float *in, const float *bias, float *out, int rows) {
  for (int row = 0; row < rows; row += TILE_ROWS)
    for (int first = 0; first < weights->columns; first += TILE) {
      const lanes *cell = weights->cells + (size_t)first / TILE * weights->inputs * 2;
      const float *x = in + (size_t)row * weights->inputs;
      lanes sum[TILE_ROWS][2];
      for (int r = 0; r < TILE_ROWS; r++) memcpy(sum[r], bias + first, sizeof sum[r]);
      for (int i = 0; i < weights->inputs; i++, cell += 2)
        for (int r = 0; r < TILE_ROWS; r++) {
          float value = x[r * weights->inputs + i];
          sum[r][0] += value * cell[0];
          sum[r][1] += value * cell[1];
        }
      for (int r = 0; r < TILE_ROWS; r++)
        memcpy(out + (size_t)(row + r) * weights->columns + first, sum[r], sizeof sum[r]);
    }
}

static inline float sigmoid(float x) { return 1.0f / (1.0f + expf(-x)); }

static inline void gate(const float *gates, int hidden, float *h, float *c) {
  for (int k = 0; k < hidden; k++) {
    float in = sigmoid(gates[k]), out = sigmoid(gates[hidden + k]), keep = sigmoid(gates[2 * hidden + k]);
    float fresh = 2.0f * sigmoid(2.0f * gates[3 * hidden + k]) - 1.0f;  // tanh
    c[k] = keep * c[k] + in * fresh;
    h[k] = out * (2.0f * sigmoid(2.0f * c[k]) - 1.0f);
  }
}

// Features of one pose (quaternions xyzw), and the pose kept for the next velocity.
static inline void see(const float pose[JOINTS][4], float previous[JOINTS][4], float rate_scale, float *out) {
  for (int joint = 0; joint < JOINTS; joint++, out += PER_JOINT) {
    const float *raw = pose[joint], *p = previous[joint];
    float norm = sqrtf(raw[0] * raw[0] + raw[1] * raw[1] + raw[2] * raw[2] + raw[3] * raw[3]);
    float x = raw[0] / norm, y = raw[1] / norm, z = raw[2] / norm, w = raw[3] / norm;
    out[0] = w * w + x * x - y * y - z * z;
    out[1] = 2 * (x * y + z * w);
    out[2] = 2 * (x * z - y * w);
    out[3] = 2 * (x * y - z * w);
    out[4] = w * w - x * x + y * y - z * z;
    out[5] = 2 * (y * z + x * w);
    float turn = 4 * (p[3] * w + p[0] * x + p[1] * y + p[2] * z);
    float scale = rate_scale * (turn < -1 ? -1 : turn > 1 ? 1 : turn);
    out[6] = scale * (p[3] * x - p[0] * w - p[1] * z + p[2] * y);
    out[7] = scale * (p[3] * y - p[1] * w - p[2] * x + p[0] * z);
    out[8] = scale * (p[3] * z - p[2] * w - p[0] * y + p[1] * x);
    out[9] = 1;
    previous[joint][0] = x, previous[joint][1] = y, previous[joint][2] = z, previous[joint][3] = w;
  }
}

struct network {
  const struct weights *weights;
  struct tiled lstm1, lstm2;
};

// One step of `count` different bodies. Emotion -1 is unknown. Returns intensities in `intensity`.
static inline void step(const struct network *network, struct body **bodies, const float (**poses)[4],
                        const int *emotions, int count, float *intensity) {
  static float in1[ROWS][INPUT1], in2[ROWS][INPUT2], gates1[ROWS][4 * HIDDEN1], gates2[ROWS][4 * HIDDEN2];
  int rows = (count + TILE_ROWS - 1) / TILE_ROWS * TILE_ROWS;
  for (int row = 0; row < count; row++) {
    see(poses[row], bodies[row]->previous, network->weights->rate_scale, in1[row]);
    memcpy(in1[row] + FEATURES, bodies[row]->h1, sizeof bodies[row]->h1);
  }
  multiply(&network->lstm1, in1[0], network->weights->bias1, gates1[0], rows);
  for (int row = 0; row < count; row++) {
    gate(gates1[row], HIDDEN1, bodies[row]->h1, bodies[row]->c1);
    memcpy(in2[row], bodies[row]->h1, sizeof bodies[row]->h1);
    memcpy(in2[row] + HIDDEN1, bodies[row]->h2, sizeof bodies[row]->h2);
  }
  multiply(&network->lstm2, in2[0], network->weights->bias2, gates2[0], rows);
  for (int row = 0; row < count; row++) {
    gate(gates2[row], HIDDEN2, bodies[row]->h2, bodies[row]->c2);
    int column = emotions[row] < 0 ? EMOTIONS : emotions[row];
    float logit = network->weights->head_bias[column];
    for (int k = 0; k < HIDDEN2; k++) logit += bodies[row]->h2[k] * network->weights->head[column][k];
    intensity[row] = sigmoid(logit);
  }
}

#endif
