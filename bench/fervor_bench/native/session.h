// One session of the load generator: connecting, sending, receiving. Everything here is the one thread's.
#ifndef FERVOR_BENCH_SESSION_H
#define FERVOR_BENCH_SESSION_H

#include <errno.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <stdbool.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "script.h"
#include "series.h"
#include "websocket.h"

enum { ROOM = 1 << 20 };

enum phase { UNCONNECTED, CONNECTING, UPGRADING, STARTING, LIVE, GONE };
enum age { YOUNG, SETTLING, SETTLED };

struct session {
  int fd;
  enum phase phase;
  enum age age;
  uint32_t variant;
  double offset_s;            // of its schedule
  uint64_t next, allowed;     // messages: the next to send, and how many may be sent by now
  uint64_t base;              // the first message of the schedule of this run
  size_t written;             // bytes of the next message
  uint32_t unanswered;        // frames of the newest message
  double sent_at;             // of the newest message
  bool blocked;
  uint8_t *rest;              // of a frame that is not all there
  size_t rest_size;
};

static struct script script;
static int epoll;
static bool open_loop, json;
static double start_s, begin_s, end_s, interval_s;
static double late_s;  // frames in the window that are answered later than this are counted
static uint32_t group;  // messages of a session that are due together
static uint64_t settle;  // messages of a session that go ahead of its schedule, each when the one before is answered
static struct series latencies, lags;
static struct {
  uint64_t sent, answered, in_window, counted, late, checkpoints, errors, blocked;
  int live, refused, closed, settling;
  bool dry;
  char first_error[256];
} tally;
static uint8_t buffer[ROOM];

static void note_error(const uint8_t *text, size_t length) {
  if (!tally.errors++) {
    size_t kept = length < sizeof tally.first_error - 1 ? length : sizeof tally.first_error - 1;
    for (size_t i = 0; i < kept; i++)
      tally.first_error[i] = text[i] < 32 || text[i] > 126 || text[i] == '"' || text[i] == '\\' ? ' ' : text[i];
  }
}

static bool scheduled(const struct session *session, uint64_t message) {
  return open_loop && message >= session->base;
}

static double due_s(const struct session *session, uint64_t message) {
  return start_s + session->offset_s + (message - session->base) / group * interval_s;
}

static void watch(struct session *session, uint32_t events, int how) {
  struct epoll_event event = {.events = events, .data.ptr = session};
  if (epoll_ctl(epoll, how, session->fd, &event)) die("epoll_ctl");
}

static void lose(struct session *session) {
  if (session->phase == GONE) return;
  if (session->phase == LIVE) {
    tally.live--;
    tally.closed++;
  } else {
    tally.refused++;
  }
  tally.settling -= session->age == SETTLING;
  session->age = SETTLED;
  session->phase = GONE;
  close(session->fd);
}

// --- sending ---------------------------------------------------------------------------------------------------------

static void flush(struct session *session) {
  while (session->phase == LIVE && session->next < session->allowed) {
    if (session->next == script.messages) {
      tally.dry = true;
      return;
    }
    const uint64_t *at = script.offsets + session->variant * script.messages + session->next;
    double now = now_s();
    if (!session->written && !session->blocked && scheduled(session, session->next)) {
      double due = due_s(session, session->next);
      if (due >= begin_s && due < end_s) add(&lags, now - due);
    }
    size_t left = at[1] - at[0] - session->written;
    ssize_t sent = send(session->fd, script.bytes + at[0] + session->written, left, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN) {
      lose(session);
      return;
    }
    if (sent > 0) session->written += sent;
    if (sent < (ssize_t)left) {
      tally.blocked += !session->blocked;
      session->blocked = true;
      watch(session, EPOLLIN | EPOLLOUT, EPOLL_CTL_MOD);
      return;
    }
    session->sent_at = now;
    session->written = 0;
    session->next++;
    session->unanswered = script.frames;
    tally.sent += script.frames;
  }
}

static void send_next(struct session *session) {
  session->allowed++;
  flush(session);
}

static void unblock(struct session *session) {
  flush(session);
  if (session->phase == LIVE && session->next == session->allowed) {
    session->blocked = false;
    watch(session, EPOLLIN, EPOLL_CTL_MOD);
  }
}

// --- receiving -------------------------------------------------------------------------------------------------------

static void on_answer(struct session *session, uint64_t seq, double now) {
  uint64_t message = seq / script.frames;
  if (message >= session->next) {
    note_error((const uint8_t *)"an answer to a frame that was not sent", 38);
    return;
  }
  tally.answered++;
  tally.in_window += now >= begin_s && now < end_s;
  bool due = scheduled(session, message);
  double from = due ? due_s(session, message) : session->sent_at;
  double at = due ? from : now;
  if (at >= begin_s && at < end_s) {
    add(&latencies, now - from);
    tally.counted++;
    tally.late += now - from > late_s;
  }
  if (due || message + 1 != session->next || !session->unanswered || --session->unanswered) return;
  if (session->age == SETTLING && session->next == settle) {
    session->age = SETTLED;  // it waits for all others
    tally.settling--;
  } else if (session->age == SETTLING || (!open_loop && now < end_s)) {
    send_next(session);
  }
}

static void on_seqs(struct session *session, const uint8_t *at, const uint8_t *end, double now) {
  const char *key = json ? "\"seq\":" : "\xa3seq";
  size_t size = strlen(key);
  while (at < end && (at = memmem(at, end - at, key, size))) {
    at += size;
    uint64_t seq = json ? strtoull((const char *)at, NULL, 10) : mp_uint(at, &at);
    on_answer(session, seq, now);
  }
}

static bool says(const struct ws_frame *frame, const char *type) {
  char word[32];
  int size = json ? snprintf(word, sizeof word, "\"%s", type) : snprintf(word, sizeof word, "%s", type);
  return memmem(frame->payload, frame->length < 64 ? frame->length : 64, word, size) != NULL;
}

static void on_message(struct session *session, const struct ws_frame *frame, double now) {
  if (session->phase == STARTING && says(frame, "session.started")) {
    session->phase = LIVE;
    tally.live++;
  } else if (says(frame, "estimate")) {
    on_seqs(session, frame->payload, frame->payload + frame->length, now);
  } else if (says(frame, "checkpoint")) {
    tally.checkpoints++;
  } else if (says(frame, "error")) {
    note_error(frame->payload, frame->length);
  }
}

static void on_frame(struct session *session, struct ws_frame *frame, double now) {
  switch (frame->opcode) {
    case TEXT:
    case BINARY:
      if (frame->final) {
        on_message(session, frame, now);
        return;
      }
      __attribute__((fallthrough));  // no service here splits its messages
    case CONTINUATION:
      note_error((const uint8_t *)"a message in several frames", 27);
      lose(session);
      return;
    case CLOSING:
      note_error(frame->length > 2 ? frame->payload + 2 : (const uint8_t *)"closed", frame->length > 2 ? frame->length - 2 : 6);
      lose(session);
      return;
    case PING: {
      uint8_t pong[131] = {0x80 | PONG, 0x80 | (frame->length & 127)};  // its mask is zero
      memcpy(pong + 6, frame->payload, frame->length & 127);
      if (send(session->fd, pong, 6 + (frame->length & 127), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) lose(session);
    }
  }
}

// Returns how many bytes of the HTTP answer were used; 0 where it is not all there.
static size_t on_upgrade(struct session *session, const uint8_t *at, size_t have) {
  const uint8_t *end = memmem(at, have, "\r\n\r\n", 4);
  if (!end) return 0;
  if (have < 12 || memcmp(at + 9, "101", 3)) {
    note_error(at, (const uint8_t *)memmem(at, have, "\r\n", 2) - at);
    lose(session);
  } else {
    session->phase = STARTING;
    if (send(session->fd, script.start, script.start_size, MSG_NOSIGNAL) < 0) lose(session);
  }
  return end + 4 - at;
}

static void receive(struct session *session) {
  size_t have = session->rest_size;
  memcpy(buffer, session->rest, have);
  ssize_t got = recv(session->fd, buffer + have, ROOM - have - 1, MSG_DONTWAIT);
  if (got <= 0) {
    if (got == 0 || errno != EAGAIN) lose(session);
    return;
  }
  double now = now_s();
  have += got;
  size_t used = 0;
  if (session->phase == UPGRADING) used = on_upgrade(session, buffer, have);
  struct ws_frame frame;
  while (session->phase > UPGRADING && session->phase < GONE && ws_read(buffer + used, have - used, &frame)) {
    used += frame.size;
    on_frame(session, &frame, now);
  }
  session->rest_size = session->phase == GONE ? 0 : have - used;
  if (session->rest_size) {
    session->rest = grown(session->rest, session->rest_size);
    memcpy(session->rest, buffer + used, session->rest_size);
  }
}

// --- connecting ------------------------------------------------------------------------------------------------------

static void dial(struct session *session, const struct addrinfo *to) {
  session->age = settle ? YOUNG : SETTLED;
  session->next = session->allowed = session->written = session->rest_size = 0;
  session->base = UINT64_MAX;
  session->blocked = false;
  session->fd = socket(to->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (session->fd < 0) die("socket");
  int yes = 1;
  setsockopt(session->fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  session->phase = CONNECTING;
  watch(session, EPOLLOUT, EPOLL_CTL_ADD);
  if (connect(session->fd, to->ai_addr, to->ai_addrlen) && errno != EINPROGRESS) lose(session);
}

// Nothing of it counts, neither as lost nor as refused.
static void hang_up(struct session *session) {
  tally.live -= session->phase == LIVE;
  if (session->phase != GONE) close(session->fd);
  session->phase = UNCONNECTED;
}

static void on_connected(struct session *session) {
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(session->fd, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error || send(session->fd, script.request, script.request_size, MSG_NOSIGNAL) < 0) {
    note_error((const uint8_t *)strerror(error), strlen(strerror(error)));
    lose(session);
    return;
  }
  session->phase = UPGRADING;
  watch(session, EPOLLIN, EPOLL_CTL_MOD);
}

static void on_event(struct session *session, uint32_t events) {
  if (session->phase == GONE || session->phase == UNCONNECTED) return;
  if (session->phase == CONNECTING) {
    on_connected(session);
    return;
  }
  if (events & (EPOLLIN | EPOLLHUP | EPOLLERR)) receive(session);
  if (session->phase == LIVE && events & EPOLLOUT) unblock(session);
}

#endif
