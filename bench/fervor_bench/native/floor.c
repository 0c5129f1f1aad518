// The floor: the least that the same work can cost. One thread, epoll, the network in C, MessagePack alone.
//
//   floor PORT WEIGHTS STATES EMOTION...
//
// Answers `session.start` and frames as the service does, for well-behaved clients on one machine: no checks, no grid,
// no gaps, no levels, no checkpoints. A body has one state, or the service's two. What waits together is computed
// together.
#define _GNU_SOURCE
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdbool.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "handshake.h"
#include "network.h"
#include "states.h"
#include "websocket.h"

enum { BODIES = 16, MOST_FRAMES = 1024, ROOM = 1 << 20, WAITING = 512 };

struct client {
  int fd, emotion;
  bool upgraded;
  struct person *bodies[BODIES];
  uint8_t *rest;
  size_t rest_size;
};

struct waiting {
  struct client *client;
  int body;
  uint64_t seq;
  double time;
  float pose[JOINTS][4];
  int of;  // frames in its message
  float intensity;
};

static struct network network;
static struct waiting waiting[WAITING];
static int waiting_count, epoll, emotion_count, states;
static char **emotion_names;
static uint8_t buffer[ROOM], answer[MOST_FRAMES * 160];
static size_t answer_size;
static int answer_left;  // estimates that the `estimates` under way lacks

static void put(const void *bytes, size_t size) {
  memcpy(answer + answer_size, bytes, size);
  answer_size += size;
}

static void put_text(const char *text) {
  uint8_t head = 0xa0 | strlen(text);  // all are short
  put(&head, 1);
  put(text, strlen(text));
}

static void put_number(double value) {
  uint64_t bits;
  memcpy(&bits, &value, 8);
  bits = __builtin_bswap64(bits);
  put("\xcb", 1);
  put(&bits, 8);
}

static void put_estimate(const struct waiting *frame) {
  char body[12];
  snprintf(body, sizeof body, "%d", frame->body);
  put("\x88", 1);  // a map of 8
  put_text("type"), put_text("estimate");
  put_text("body"), put_text(body);
  uint64_t seq = __builtin_bswap64(frame->seq);
  put_text("seq"), put("\xcf", 1), put(&seq, 8);
  put_text("t"), put_number(frame->time);
  put_text("intensity"), put_number(frame->intensity);
  put_text("level"), put_text(frame->intensity < 0.5f ? "weak" : "strong");
  put_text("emotion"), put_text(frame->client->emotion < 0 ? "unknown" : emotion_names[frame->client->emotion]);
  put_text("status"), put_text("ok");
}

static void send_answer(struct client *client) {
  uint8_t head[4];
  size_t size = ws_head(head, BINARY, answer_size);
  memmove(answer + size, answer, answer_size);
  memcpy(answer, head, size);
  if (send(client->fd, answer, answer_size + size, MSG_NOSIGNAL | MSG_DONTWAIT) < 0 && errno != EAGAIN)
    shutdown(client->fd, SHUT_RDWR);
  answer_size = 0;
}

static void tell(const struct waiting *frame) {
  if (frame->of == 1) {
    put_estimate(frame);
    send_answer(frame->client);
    return;
  }
  if (!answer_left) {
    uint8_t head[3] = {0xdc, frame->of >> 8, frame->of};
    put("\x82", 1);
    put_text("type"), put_text("estimates");
    put_text("estimates"), put(head, 3);
    answer_left = frame->of;
  }
  put_estimate(frame);
  if (!--answer_left) send_answer(frame->client);
}

static struct batch {
  struct body *bodies[ROWS];
  const float (*poses[ROWS])[4];
  int emotions[ROWS], frames[ROWS], count;
  float shares[ROWS], intensity[ROWS];
} batch;

// Puts one step of a frame's body into the batch: a row for each state that runs.
static void lay_out(int frame, struct person *person) {
  uint64_t index = person->steps++;
  for (int state = 0; state < states && runs(index, state); state++) {
    if (states > 1 && restarts(index, state)) memset(person->states + state, 0, sizeof *person->states);
    int row = batch.count++;
    batch.bodies[row] = person->states + state;
    batch.poses[row] = (const float(*)[4])waiting[frame].pose;
    batch.emotions[row] = waiting[frame].client->emotion;
    batch.frames[row] = frame;
    batch.shares[row] = states == 1 ? 1 : share(index, state);
  }
}

// A body steps once a batch, so several of its frames take as many rounds.
static void compute(void) {
  static int round;
  static bool done[WAITING];
  memset(done, 0, waiting_count);
  for (int left = waiting_count; left;) {
    round++;
    batch.count = 0;
    for (int i = 0; i < waiting_count && batch.count + states <= ROWS; i++) {
      struct person *person = waiting[i].client->bodies[waiting[i].body];
      if (done[i] || person->round == round) continue;
      person->round = round;
      done[i] = true;
      left--;
      lay_out(i, person);
    }
    step(&network, batch.bodies, batch.poses, batch.emotions, batch.count, batch.intensity);
    for (int row = 0; row < batch.count; row++)
      waiting[batch.frames[row]].intensity += batch.shares[row] * batch.intensity[row];
  }
  for (int i = 0; i < waiting_count; i++) tell(waiting + i);
  waiting_count = 0;
}

// The value behind a key of a map, looked for by its bytes.
static const uint8_t *value_of(const uint8_t *at, const uint8_t *end, const char *key) {
  const uint8_t *found = memmem(at, end - at, key, strlen(key));
  return found ? found + strlen(key) : NULL;
}

static void queue(struct client *client, uint64_t seq, int body, double time, const uint8_t *pose, int of) {
  if (!client->bodies[body]) {
    client->bodies[body] = calloc(1, sizeof(struct person));
    if (!client->bodies[body]) die("memory");
  }
  struct waiting *frame = waiting + waiting_count++;
  *frame = (struct waiting){.client = client, .body = body, .seq = seq, .time = time, .of = of};
  memcpy(frame->pose, pose, sizeof frame->pose);
  if (waiting_count == WAITING) compute();
}

// Frames as script.py lays them out: body, seq, t, q, in this order.
static void on_frames(struct client *client, const uint8_t *at, const uint8_t *end, int of) {
  const uint8_t *body, *seq, *t, *q, *after;
  for (int frame = 0; frame < of; frame++) {
    if (!(body = value_of(at, end, "\xa4" "body")) || !(seq = value_of(body, end, "\xa3seq")) ||
        !(t = value_of(seq, end, "\xa1t")) || !(q = value_of(t, end, "\xa1q\xc4\xd0")) || q + 208 > end)
      return;
    uint64_t bits;
    double time;
    memcpy(&bits, t + 1, 8);
    bits = __builtin_bswap64(bits);
    memcpy(&time, &bits, 8);
    int number = 0;
    for (int i = 1; i <= (*body & 31); i++) number = number * 10 + body[i] - '0';
    queue(client, mp_uint(seq, &after), number % BODIES, time, q, of);
    at = q + 208;
  }
}

static void on_start(struct client *client, const uint8_t *at, const uint8_t *end) {
  const uint8_t *label = value_of(at, end, "\xa7" "emotion");
  client->emotion = -1;
  for (int i = 0; label && i < emotion_count; i++)
    if ((size_t)(*label & 31) == strlen(emotion_names[i]) && !memcmp(label + 1, emotion_names[i], *label & 31))
      client->emotion = i;
  put("\x82", 1);
  put_text("type"), put_text("session.started");
  put_text("session_id"), put_text("floor");
  send_answer(client);
}

static void on_message(struct client *client, const uint8_t *at, const uint8_t *end) {
  const uint8_t *frames = memmem(at, end - at, "\xa6" "frames\xa6" "frames", 14);
  if (memmem(at, end - at, "\xad" "session.start", 14)) {
    on_start(client, at, end);
  } else if (frames && frames[14] == 0xdc) {
    on_frames(client, frames + 17, end, frames[15] << 8 | frames[16]);
  } else if (frames) {
    on_frames(client, frames + 15, end, frames[14] & 15);
  } else {
    on_frames(client, at, end, 1);
  }
}

static void leave(struct client *client) {
  compute();  // nothing that waits may name a client that is gone
  close(client->fd);
  for (int i = 0; i < BODIES; i++) free(client->bodies[i]);
  free(client->rest);
  free(client);
}

static size_t on_request(struct client *client, const uint8_t *at, size_t have) {
  const uint8_t *end = memmem(at, have, "\r\n\r\n", 4);
  if (!end) return 0;
  char said[256];
  int size = upgrade_answer((const char *)at, have, said, sizeof said);
  if (send(client->fd, said, size, MSG_NOSIGNAL) < 0) return 0;
  client->upgraded = true;
  return end + 4 - at;
}

static void receive(struct client *client) {
  size_t have = client->rest_size, used = 0;
  memcpy(buffer, client->rest, have);
  ssize_t got = recv(client->fd, buffer + have, ROOM - have, MSG_DONTWAIT);
  if (got < 0 && errno == EAGAIN) return;
  if (got <= 0) {
    leave(client);
    return;
  }
  have += got;
  if (!client->upgraded) used = on_request(client, buffer, have);
  struct ws_frame frame;
  while (client->upgraded && ws_read(buffer + used, have - used, &frame)) {
    used += frame.size;
    ws_mask(frame.payload, frame.length, frame.mask);
    if (frame.opcode == BINARY) on_message(client, frame.payload, frame.payload + frame.length);
    if (frame.opcode == CLOSING) shutdown(client->fd, SHUT_RDWR);
  }
  client->rest_size = have - used;
  if (client->rest_size) {
    client->rest = grown(client->rest, client->rest_size);
    memcpy(client->rest, buffer + used, client->rest_size);
  }
}

static void welcome(int listener) {
  int fd, yes = 1;
  while ((fd = accept4(listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0) {
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    struct client *client = calloc(1, sizeof *client);
    if (!client) die("memory");
    client->fd = fd;
    struct epoll_event event = {.events = EPOLLIN, .data.ptr = client};
    if (epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event)) die("epoll_ctl");
  }
}

static struct weights *read_weights(const char *path) {
  static struct weights weights;
  FILE *file = fopen(path, "rb");
  if (!file || fread(&weights, sizeof weights, 1, file) != 1 || fgetc(file) != EOF) die(path);
  fclose(file);
  return &weights;
}

static int listen_at(int port) {
  int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), yes = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
  if (bind(listener, (struct sockaddr *)&at, sizeof at) || listen(listener, 1024)) die("listen");
  return listener;
}

int main(int count, char **words) {
  states = count < 4 ? 0 : atoi(words[3]);
  if (states < 1 || states > MOST_STATES) {
    fputs("floor PORT WEIGHTS STATES EMOTION...\n", stderr);
    return 64;
  }
  struct weights *weights = read_weights(words[2]);
  emotion_names = words + 4;
  emotion_count = count - 4;
  network = (struct network){weights, tile(weights->lstm1[0], INPUT1, 4 * HIDDEN1),
                             tile(weights->lstm2[0], INPUT2, 4 * HIDDEN2)};
  struct rlimit files;
  if (!getrlimit(RLIMIT_NOFILE, &files)) {
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
  }
  int listener = listen_at(atoi(words[1]));
  epoll = epoll_create1(EPOLL_CLOEXEC);
  struct epoll_event event = {.events = EPOLLIN, .data.ptr = NULL}, events[256];
  if (epoll_ctl(epoll, EPOLL_CTL_ADD, listener, &event)) die("epoll_ctl");
  for (;;) {
    int ready = epoll_wait(epoll, events, 256, -1);
    for (int i = 0; i < ready; i++) {
      if (events[i].data.ptr)
        receive(events[i].data.ptr);
      else
        welcome(listener);
    }
    if (waiting_count) compute();
  }
}
