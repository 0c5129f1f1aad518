// Load generator: many WebSocket sessions from one thread, at their own pace (open loop) or as fast as they are
// answered (closed loop).
//
//   load HOST PORT SCRIPT RESULT MOST_SESSIONS random|lockstep SETTLE
//
// SCRIPT holds all bytes to send, masked and framed (traffic.py writes it). It does what standard input says, line by
// line, and answers on standard output:
//
//   open SESSIONS
//     has so many sessions, those of before and new ones, or fewer: "ready", how many are started, how many were not.
//   run open|closed spin|sleep WARMUP_S SECONDS BACKLOG_S LATE_S
//     all of them send: "begin" and "end" around the measured window, then one JSON object. RESULT gets the latencies
//     and the lags, float32 microseconds.
//
// First every new session sends SETTLE messages, each when the one before is answered: it is as old as robots are.
// Open loop: latency counts from the moment when a message was due, whenever it could be sent (no coordinated
// omission); `lag` is how late the generator itself was. Closed loop: latency counts from the send.
//
// An open loop ends early, as lost, where the frames of more than BACKLOG_S seconds wait for their answers, or where so
// many were answered after LATE_S that 1 % of the whole window's will have been.
//
// `spin`: between messages it polls, since a processor that sleeps wakes up late; its busy time then is that of the
// rounds in which something was sent or came. `sleep`: it naps, and leaves its processor to others meanwhile, who would
// else take the service's; its busy time is processor time. It does not sleep until an answer comes: then every answer
// would have to wake it, which takes the service as long as the answer itself, and which no robot at the other end of a
// network asks of it.
#define _GNU_SOURCE
#include <sched.h>
#include <sys/resource.h>

#include "session.h"

enum { CONNECTS_AT_ONCE = 32, SETTLE_AT_ONCE = 64, BURST = 64 };
enum { EVENTS = 16 };  // at once: few, so that what is due leaves before all answers are read
static const double GRACE_S = 2.0, START_S = 60.0, LATE_SHARE = 0.011;  // above 1 %, since windows cut turns

static struct session *sessions, **order;  // order: by when they are due in a turn
static int session_count;
static bool told;  // standard input said something
static enum { BLOCK, NAP, SPIN } waits;  // see `turn`
static const double NAP_S = 0.0002;

// Sleeps until `until`, but for a nap at most.
static void nap(double until) {
  double wake = now_s() + NAP_S;
  if (until < wake) wake = until;
  struct timespec at = {.tv_sec = wake, .tv_nsec = (wake - (time_t)wake) * 1e9};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

// Handles what has happened. Before that it waits: until something does, or until `until` (BLOCK); for a nap that ends
// by then (NAP); not at all (SPIN, or 0). Returns whether anything happened.
static bool turn(double until) {
  static bool more;
  double left = until - now_s();
  if (waits == NAP && left > 0 && !more) nap(until);
  struct epoll_event events[EVENTS];
  int count = epoll_wait(epoll, events, EVENTS, waits == BLOCK && left > 0 ? (int)(left * 1e3) + 1 : 0);
  more = count == EVENTS;
  for (int i = 0; i < count; i++) {
    if (events[i].data.ptr == NULL)
      told = true;
    else
      on_event(events[i].data.ptr, events[i].events);
  }
  return count > 0;
}

static void open_all(int count, const struct addrinfo *to) {
  while (session_count > count) hang_up(sessions + --session_count);
  double give_up = now_s() + START_S;
  while (tally.live + tally.refused + tally.closed < count && now_s() < give_up) {
    while (session_count < count && session_count - tally.live - tally.refused - tally.closed < CONNECTS_AT_ONCE)
      dial(sessions + session_count++, to);
    turn(now_s() + 0.1);
  }
  printf("ready %d %d %s\n", tally.live, tally.refused, tally.first_error);
  fflush(stdout);
}

// --- the run ---------------------------------------------------------------------------------------------------------

static int by_offset(const void *a, const void *b) {
  double x = (*(struct session *const *)a)->offset_s, y = (*(struct session *const *)b)->offset_s;
  return (x > y) - (x < y);
}

static void spread(int most, bool lockstep) {
  group = script.bodies > script.frames ? script.bodies / script.frames : 1;
  interval_s = (script.frames > script.bodies ? script.frames / script.bodies : 1) / script.rate_hz;
  srand48(1);
  for (int i = 0; i < most; i++) {
    sessions[i].variant = i % script.variants;
    sessions[i].offset_s = lockstep ? 0 : drand48() * interval_s;
  }
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
    struct session *session = order[*place];
    double due = start_s + session->offset_s + *tick * interval_s;
    if (due > now_s()) return due;
    if (due >= end_s) return 1e18;
    session->allowed = session->base + (*tick + 1) * group;
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
  do {
    for (; begun < session_count && tally.settling < SETTLE_AT_ONCE; begun++) {
      if (sessions[begun].phase != LIVE || sessions[begun].age != YOUNG) continue;
      sessions[begun].age = SETTLING;
      tally.settling++;
      send_next(sessions + begun);
    }
    if (tally.settling) turn(now_s() + 0.1);
  } while ((tally.settling || begun < session_count) && now_s() < give_up);
}

// All sessions begin a schedule, and counting begins anew.
static void prepare(void) {
  latencies.count = lags.count = 0;
  tally.sent = tally.answered = tally.in_window = tally.counted = tally.late = 0;
  tally.checkpoints = tally.blocked = 0;
  tally.settling = 0;
  tally.dry = false;
  for (int i = 0; i < session_count; i++) {
    order[i] = sessions + i;
    sessions[i].age = SETTLED;
    sessions[i].base = sessions[i].allowed = sessions[i].next;
  }
  qsort(order, session_count, sizeof *order, by_offset);
}

struct plan { double warmup_s, seconds, backlog_s; };

// Whether the open loop can't be kept any more.
static bool is_lost(const struct plan *plan) {
  double a_second = session_count * (double)script.bodies * script.rate_hz;
  return open_loop && (tally.sent - tally.answered > (plan->backlog_s + interval_s) * a_second ||
                       tally.late > LATE_SHARE * plan->seconds * a_second + 1);
}

// Sends what is due before the end and did not leave yet, and waits for answers, but not for ever.
static void finish(uint64_t *tick, int *place, double now) {
  while (open_loop && send_due(tick, place) == 0) turn(0);
  while (tally.answered < tally.sent && tally.live && now_s() < now + GRACE_S) turn(now_s() + 0.05);
}

// Where it sleeps it needs little of its processor, and may take it at once, if the kernel lets it: whoever else runs
// there would make it late. Where it spins it would leave nothing to anybody.
static void go_first(bool first) {
  struct sched_param how = {.sched_priority = first};
  sched_setscheduler(0, first ? SCHED_FIFO : SCHED_OTHER, &how);
}

// Returns the seconds of the window in which it was busy.
static double run(const struct plan *plan, bool *lost) {
  prepare();
  go_first(waits == NAP);
  start_s = now_s() + 0.05;
  begin_s = start_s + plan->warmup_s;
  end_s = begin_s + plan->seconds;
  uint64_t tick = 0;
  int place = 0;
  bool begun = false;
  double used = 0, busy = 0, now = now_s();
  for (int i = 0; !open_loop && i < session_count; i++) send_next(sessions + i);
  while (now < end_s && tally.live && !(tally.dry && !open_loop) && !*lost && !told) {  // told: nobody listens any more
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
    *lost = is_lost(plan);
  }
  if (waits == NAP) busy = cpu_s() - used;
  waits = BLOCK;
  go_first(false);
  say("end");
  if (now < end_s) end_s = now;  // it is lost, or the script or the sessions came to an end
  if (end_s < begin_s) begin_s = end_s;
  finish(&tick, &place, now);
  return begun ? busy : 0;
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
    for (uint64_t m = sessions[i].base; m < script.messages && due_s(sessions + i, m) < end_s; m++)
      due += due_s(sessions + i, m) >= begin_s ? script.frames : 0;
  return open_loop ? due - tally.counted : 0;
}

// Frames that were sent and have no answer, or could not be sent to their end.
static uint64_t count_under_way(void) {
  uint64_t unsent = 0;
  for (int i = 0; i < session_count; i++) unsent += sessions[i].phase == LIVE && sessions[i].next < sessions[i].allowed;
  return tally.sent - tally.answered + unsent;
}

static void tell(double busy, bool lost) {
  printf("{\"sessions\": %d, \"refused\": %d, \"closed\": %d, \"errors\": %lu, \"first_error\": \"%s\", "
         "\"frames\": %lu, \"unanswered\": %lu, \"under_way\": %lu, \"checkpoints\": %lu, \"blocked\": %lu, "
         "\"dry\": %s, \"lost\": %s, \"window_s\": %.6f, \"busy_s\": %.6f}\n",
         tally.live, tally.refused, tally.closed, tally.errors, tally.first_error, tally.in_window, count_unanswered(),
         count_under_way(), tally.checkpoints, tally.blocked, tally.dry ? "true" : "false", lost ? "true" : "false",
         end_s - begin_s, busy);
  fflush(stdout);
}

// --- what it is told to do -------------------------------------------------------------------------------------------

static void obey_run(const char *line, const char *result) {
  char loop[8], how[8];
  struct plan plan;
  if (sscanf(line, "run %7s %7s %lf %lf %lf %lf", loop, how, &plan.warmup_s, &plan.seconds, &plan.backlog_s,
             &late_s) != 6)
    die(line);
  bool lost = false;
  open_loop = !strcmp(loop, "open");
  begin_s = end_s = 1e18;
  settle_all();
  waits = strcmp(how, "spin") ? NAP : SPIN;
  double busy = run(&plan, &lost);
  write_result(result);
  tell(busy, lost);
}

static void obey(const char *result, int most, const struct addrinfo *to) {
  char line[256];
  int count;
  for (;;) {
    while (!told) turn(now_s() + 1.0);
    if (!fgets(line, sizeof line, stdin)) return;  // whoever started this is done, or gone
    told = false;
    if (sscanf(line, "open %d", &count) == 1)
      open_all(count < most ? count : most, to);
    else
      obey_run(line, result);
  }
}

static void allow_files(int count) {
  struct rlimit files = {.rlim_cur = count, .rlim_max = count}, had;
  if (!getrlimit(RLIMIT_NOFILE, &had) && had.rlim_cur < files.rlim_cur) {
    files.rlim_max = had.rlim_max > files.rlim_cur ? had.rlim_max : files.rlim_cur;
    if (setrlimit(RLIMIT_NOFILE, &files)) die("open files");
  }
}

int main(int count, char **words) {
  if (count != 8) {
    fputs("load HOST PORT SCRIPT RESULT MOST_SESSIONS random|lockstep SETTLE\n", stderr);
    return 64;
  }
  script = read_script(words[3]);
  json = (*script.bytes & 15) == TEXT;
  int most = atoi(words[5]);
  sessions = calloc(most, sizeof *sessions);
  order = calloc(most, sizeof *order);
  settle = strtoull(words[7], NULL, 10);
  begin_s = end_s = 1e18;
  struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *to;
  if (getaddrinfo(words[1], words[2], &hints, &to)) die(words[1]);
  allow_files(most + 64);
  epoll = epoll_create1(EPOLL_CLOEXEC);
  struct epoll_event hear = {.events = EPOLLIN};
  if (epoll_ctl(epoll, EPOLL_CTL_ADD, STDIN_FILENO, &hear))
    die("epoll");
  spread(most, !strcmp(words[6], "lockstep"));
  obey(words[4], most, to);
  return 0;
}
