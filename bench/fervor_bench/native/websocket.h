// What the load generator and the floor share of RFC 6455: frame headers, masking, and time.
#ifndef FERVOR_BENCH_WEBSOCKET_H
#define FERVOR_BENCH_WEBSOCKET_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum opcode { CONTINUATION = 0, TEXT = 1, BINARY = 2, CLOSING = 8, PING = 9, PONG = 10 };

struct ws_frame {
  int final, opcode, masked;
  uint8_t *payload;
  size_t length, size;  // of the payload; of the whole frame
  uint8_t mask[4];
};

// Reads one frame's header at `at`. Returns 0 where not all of the frame is there yet.
static inline int ws_read(uint8_t *at, size_t have, struct ws_frame *frame) {
  if (have < 2) return 0;
  size_t head = 2;
  uint64_t length = at[1] & 127;
  if (length == 126) {
    if (have < 4) return 0;
    length = (uint64_t)at[2] << 8 | at[3];
    head = 4;
  } else if (length == 127) {
    if (have < 10) return 0;
    length = 0;
    for (int i = 2; i < 10; i++) length = length << 8 | at[i];
    head = 10;
  }
  frame->final = at[0] >> 7;
  frame->opcode = at[0] & 15;
  frame->masked = at[1] >> 7;
  if (frame->masked) {
    if (have < head + 4) return 0;
    memcpy(frame->mask, at + head, 4);
    head += 4;
  }
  if (have - head < length) return 0;
  frame->payload = at + head;
  frame->length = length;
  frame->size = head + length;
  return 1;
}

static inline void ws_mask(uint8_t *bytes, size_t length, const uint8_t mask[4]) {
  uint64_t wide, word;
  memcpy(&wide, mask, 4);
  memcpy((uint8_t *)&wide + 4, mask, 4);
  size_t i = 0;
  for (; i + 8 <= length; i += 8) {
    memcpy(&word, bytes + i, 8);
    word ^= wide;
    memcpy(bytes + i, &word, 8);
  }
  for (; i < length; i++) bytes[i] ^= mask[i & 3];
}

// Writes an unmasked header; returns its size.
static inline size_t ws_head(uint8_t *at, int opcode, size_t length) {
  at[0] = 0x80 | opcode;
  if (length < 126) {
    at[1] = length;
    return 2;
  }
  at[1] = 126;  // what is sent here stays below 64 KiB
  at[2] = length >> 8;
  at[3] = length;
  return 4;
}

// Seconds of a clock that only goes forward.
static inline double now_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec + now.tv_nsec * 1e-9;
}

static inline void die(const char *what) {
  perror(what);
  exit(1);
}

static inline void *grown(void *memory, size_t bytes) {
  memory = realloc(memory, bytes);
  if (!memory) die("memory");
  return memory;
}

// The MessagePack unsigned integer at `at`; `after` is set behind it.
static inline uint64_t mp_uint(const uint8_t *at, const uint8_t **after) {
  int bytes = *at == 0xcc ? 1 : *at == 0xcd ? 2 : *at == 0xce ? 4 : *at == 0xcf ? 8 : 0;
  uint64_t value = bytes ? 0 : *at;
  for (int i = 1; i <= bytes; i++) value = value << 8 | at[i];
  *after = at + 1 + bytes;
  return value;
}

#endif
