// Load generator: many WebSocket sessions from one thread, at their own pace (open loop) or as fast as they are
// answered (closed loop).
//
//   load HOST PORT SCRIPT RESULT SESSIONS open|closed random|lockstep spin|sleep SETTLE WARMUP_S SECONDS
//
// SCRIPT holds all bytes to send, masked and framed (traffic.py writes it). On standard output: "ready" once all
// sessions are started, then it waits for a line on standard input; "begin" and "end" around the measured window;
// last, one JSON object. RESULT gets the latencies and the lags, float32 microseconds.
//
// First every session sends SETTLE messages, each when the one before is answered: it is measured as it is later on.
// Open loop: latency counts from the moment when a message was due, whenever it could be sent (no coordinated
// omission); `lag` is how late the generator itself was. Closed loop: latency counts from the send.
//
// `spin`: between messages it polls, since a processor that sleeps wakes up late; its busy time then is that of the
// rounds in which something was sent or came. `sleep`: where it shares its processor, its busy time is processor time.
#define _GNU_SOURCE
#include <sys/resource.h>
#include <sys/timerfd.h>

#include "session.h"

enum { CONNECTS_AT_ONCE = 32, SETTLE_AT_ONCE = 64, BURST = 64 };
static const double GRACE_S = 2.0, START_S = 60.0;

static struct session *sessions;
static int session_count, timer;
static bool spin, told;  // told: standard input said something

// Handles what happens until `until`, or what is there already for 0 and while spinning. Returns whether something did.
static bool turn(double until) {
  static double armed;
  if (spin) until = 0;
  if (until > 0 && until != armed) {
    struct itimerspec at = {.it_value = {.tv_sec = until, .tv_nsec = (until - (time_t)until) * 1e9}};
    if (timerfd_settime(timer, TFD_TIMER_ABSTIME, &at, NULL)) die("timerfd");
    armed = until;
  }
  struct epoll_event events[256];
  int count = epoll_wait(epoll, events, 256, until > 0 ? -1 : 0);
  for (int i = 0; i < count; i++) {
    uint64_t ticks;
    if (events[i].data.ptr == &timer) {
      if (read(timer, &ticks, sizeof ticks) > 0) armed = 0;
    } else if (events[i].data.ptr == NULL) {
      told = true;
    } else {
      on_event(events[i].data.ptr, events[i].events);
    }
  }
  return count > 0;
}

static void dial_all(const struct addrinfo *to) {
  int dialled = 0;
  double give_up = now_s() + START_S;
  while (tally.live + tally.refused + tally.closed < session_count && now_s() < give_up) {
    while (dialled < session_count && dialled - tally.live - tally.refused - tally.closed < CONNECTS_AT_ONCE)
      dial(sessions + dialled++, to);
    turn(now_s() + 0.1);
  }
}

// --- the run ---------------------------------------------------------------------------------------------------------

static int by_offset(const void *a, const void *b) {
  double x = ((const struct session *)a)->offset_s, y = ((const struct session *)b)->offset_s;
  return (x > y) - (x < y);
}

static void spread(bool lockstep) {
  group = script.bodies > script.frames ? script.bodies / script.frames : 1;
  interval_s = (script.frames > script.bodies ? script.frames / script.bodies : 1) / script.rate_hz;
  srand48(1);
  for (int i = 0; i < session_count; i++) {
    sessions[i].variant = i % script.variants;
    sessions[i].offset_s = lockstep ? 0 : drand48() * interval_s;
  }
  qsort(sessions, session_count, sizeof *sessions, by_offset);
}

static void say(const char *word) {
  puts(word);
  fflush(stdout);
}

static double cpu_s(void) {
  struct rusage used;
  getrusage(RUSAGE_SELF, &used);
  return used.ru_utime.tv_sec + used.ru_stime.tv_sec + (used.ru_utime.tv_usec + used.ru_stime.tv_usec) * 1e-6;
}

// Sends what is due, at most BURST messages in a row; returns when the next is due.
static double send_due(uint64_t *tick, int *place) {
  for (int sent = 0; sent < BURST; sent++) {
    struct session *session = sessions + *place;
    double due = start_s + session->offset_s + *tick * interval_s;
    if (due > now_s()) return due;
    if (due >= end_s) return 1e18;
    session->allowed = settle + (*tick + 1) * group;
    if (!session->blocked) flush(session);
    if (++*place == session_count) {
      *place = 0;
      ++*tick;
    }
  }
  return 0;
}

// Few sessions at once: all together might be more than the service can bear.
static void settle_all(void) {
  double give_up = now_s() + START_S;
  int begun = 0;
  while (settle && tally.settled < tally.live && now_s() < give_up) {
    while (begun < session_count && begun - tally.settled - tally.refused - tally.closed < SETTLE_AT_ONCE)
      send_next(sessions + begun++);
    turn(now_s() + 0.1);
  }
}

// Returns the seconds of the window in which it was busy.
static double run(double warmup_s, double seconds) {
  start_s = now_s() + 0.05;
  begin_s = start_s + warmup_s;
  end_s = begin_s + seconds;
  uint64_t tick = 0;
  int place = 0;
  bool begun = false;
  double used = 0, busy = 0, now = now_s();
  for (int i = 0; !open_loop && i < session_count; i++) send_next(sessions + i);
  while (now < end_s && tally.live && !(tally.dry && !open_loop)) {
    if (!begun && now >= begin_s) {
      begun = true;
      used = cpu_s(), busy = 0;
      say("begin");
    }
    uint64_t sent = tally.sent;
    double next = open_loop ? send_due(&tick, &place) : 1e18;
    double edge = begun ? end_s : begin_s, before = now;
    bool moved = turn(next < edge ? next : edge);
    now = now_s();
    if (moved || tally.sent > sent) busy += now - before;
  }
  if (!spin) busy = cpu_s() - used;
  spin = false;
  say("end");
  if (now < end_s) end_s = now;  // the script or the sessions came to an end
  while (open_loop && send_due(&tick, &place) == 0) turn(0);  // what was due just before the end, and is late
  while (tally.answered < tally.sent && tally.live && now_s() < now + GRACE_S) turn(now_s() + 0.05);
  return busy;
}

// --- results ---------------------------------------------------------------------------------------------------------

static void write_result(const char *path) {
  FILE *file = fopen(path, "wb");
  if (!file) die(path);
  write_series(file, &latencies);
  write_series(file, &lags);
  if (fclose(file)) die(path);
}

// Frames that were due in the window and have no answer: they wait still.
static uint64_t count_unanswered(void) {
  uint64_t due = 0;
  for (int i = 0; open_loop && i < session_count; i++)
    for (uint64_t m = settle; m < script.messages && due_s(sessions + i, m) < end_s; m++)
      due += due_s(sessions + i, m) >= begin_s ? script.frames : 0;
  return open_loop ? due - tally.counted : 0;
}

int main(int count, char **words) {
  if (count != 12) {
    fputs("load HOST PORT SCRIPT RESULT SESSIONS open|closed random|lockstep spin|sleep SETTLE WARMUP_S SECONDS\n",
          stderr);
    return 64;
  }
  script = read_script(words[3]);
  json = (*script.bytes & 15) == TEXT;
  session_count = atoi(words[5]);
  sessions = calloc(session_count, sizeof *sessions);
  open_loop = !strcmp(words[6], "open");
  settle = strtoull(words[9], NULL, 10);
  begin_s = end_s = 1e18;
  struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *to;
  if (getaddrinfo(words[1], words[2], &hints, &to)) die(words[1]);
  struct rlimit files = {.rlim_cur = session_count + 64, .rlim_max = session_count + 64}, had;
  if (!getrlimit(RLIMIT_NOFILE, &had) && had.rlim_cur < files.rlim_cur) {
    files.rlim_max = had.rlim_max > files.rlim_cur ? had.rlim_max : files.rlim_cur;
    if (setrlimit(RLIMIT_NOFILE, &files)) die("open files");
  }
  epoll = epoll_create1(EPOLL_CLOEXEC);
  timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  struct epoll_event tell = {.events = EPOLLIN, .data.ptr = &timer}, hear = {.events = EPOLLIN};
  if (epoll_ctl(epoll, EPOLL_CTL_ADD, timer, &tell) || epoll_ctl(epoll, EPOLL_CTL_ADD, STDIN_FILENO, &hear))
    die("epoll");
  spread(!strcmp(words[7], "lockstep"));
  dial_all(to);
  printf("ready %d %d %s\n", tally.live, tally.refused, tally.first_error);
  fflush(stdout);
  while (!told) turn(now_s() + 1.0);
  char word[16];
  if (read(STDIN_FILENO, word, sizeof word) <= 0) return 0;  // whoever started this is gone
  epoll_ctl(epoll, EPOLL_CTL_DEL, STDIN_FILENO, NULL);
  spin = !strcmp(words[8], "spin");
  settle_all();
  double busy = run(atof(words[10]), atof(words[11]));
  write_result(words[4]);
  printf("{\"sessions\": %d, \"refused\": %d, \"closed\": %d, \"errors\": %lu, \"first_error\": \"%s\", "
         "\"frames\": %lu, \"unanswered\": %lu, \"checkpoints\": %lu, \"blocked\": %lu, \"dry\": %s, "
         "\"window_s\": %.6f, \"busy_s\": %.6f}\n",
         tally.live, tally.refused, tally.closed, tally.errors, tally.first_error, tally.in_window, count_unanswered(),
         tally.checkpoints, tally.blocked, tally.dry ? "true" : "false", end_s - begin_s, busy);
  return 0;
}
