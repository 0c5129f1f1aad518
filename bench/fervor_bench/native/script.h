// What the load generator sends: all bytes of a run, as traffic.py writes them.
#ifndef FERVOR_BENCH_SCRIPT_H
#define FERVOR_BENCH_SCRIPT_H

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "websocket.h"

struct script {
  uint32_t variants, messages, frames, bodies;  // messages a variant, frames a message
  double rate_hz;
  const uint8_t *request, *start, *bytes;
  uint32_t request_size, start_size;
  const uint64_t *offsets;  // [variant * messages + message], one more at the end
};

static inline const uint8_t *take(const uint8_t **at, size_t size) {
  const uint8_t *taken = *at;
  *at += size;
  return taken;
}

static inline struct script read_script(const char *path) {
  int fd = open(path, O_RDONLY);
  struct stat about;
  if (fd < 0 || fstat(fd, &about)) die(path);
  const uint8_t *at = mmap(NULL, about.st_size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0);
  if (at == MAP_FAILED) die(path);
  const uint32_t *head = (const uint32_t *)take(&at, 32);
  struct script script = {.variants = head[0], .messages = head[1], .frames = head[2], .bodies = head[3],
                          .request_size = head[4], .start_size = head[5]};
  memcpy(&script.rate_hz, head + 6, 8);
  script.offsets = (const uint64_t *)take(&at, 8 * ((size_t)script.variants * script.messages + 1));
  script.request = take(&at, script.request_size);
  script.start = take(&at, script.start_size);
  script.bytes = at;
  return script;
}

#endif
