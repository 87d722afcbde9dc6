// The queue of everything that happens at a cycle: a binary heap ordered by
// cycle, then by the order of scheduling, so that two runs serve equal events
// in the same order.
#include <stdlib.h>

#include "chip.h"

static bool earlier(const event* a, const event* b) {
  return a->cycle < b->cycle || (a->cycle == b->cycle && a->sequence < b->sequence);
}

static void place(chip* c, uint32_t index, event* e) {
  c->heap[index] = e;
  e->slot = index + 1;
}

static void sift_up(chip* c, uint32_t index) {
  event* const e = c->heap[index];
  while (index > 0 && earlier(e, c->heap[(index - 1) / 2])) {
    place(c, index, c->heap[(index - 1) / 2]);
    index = (index - 1) / 2;
  }
  place(c, index, e);
}

static void sift_down(chip* c, uint32_t index) {
  event* const e = c->heap[index];
  for (;;) {
    uint32_t child = 2 * index + 1;
    if (child >= c->heap_count) break;
    if (child + 1 < c->heap_count && earlier(c->heap[child + 1], c->heap[child])) child++;
    if (!earlier(c->heap[child], e)) break;
    place(c, index, c->heap[child]);
    index = child;
  }
  place(c, index, e);
}

void event_cancel(chip* c, event* e) {
  if (e->slot == 0) return;
  const uint32_t index = e->slot - 1;
  e->slot = 0;
  event* const last = c->heap[--c->heap_count];
  if (last == e) return;
  place(c, index, last);
  sift_up(c, index);
  sift_down(c, last->slot - 1);
}

void event_at(chip* c, event* e, uint64_t cycle) {
  event_cancel(c, e);
  if (c->heap_count == c->heap_capacity) {
    c->heap_capacity = c->heap_capacity ? 2 * c->heap_capacity : 256;
    c->heap = realloc(c->heap, c->heap_capacity * sizeof *c->heap);
    if (!c->heap) abort();
  }
  e->cycle = cycle;
  e->sequence = c->event_sequence++;
  c->heap_count++;
  place(c, c->heap_count - 1, e);
  sift_up(c, c->heap_count - 1);
  // A burst of instructions that is under way must end where the new event
  // lies.
  avr_t* const avr = c->avr;
  const uint64_t room = cycle > avr->cycle ? cycle - avr->cycle : 0;
  if (room < avr->run_cycle_count) avr->run_cycle_count = room;
}

void event_post(chip* c, uint64_t cycle, event_fn run, void* param, uint64_t argument) {
  event* e = c->free_events;
  if (e) {
    c->free_events = e->next_free;
  } else {
    e = calloc(1, sizeof *e);
    if (!e) abort();
  }
  e->slot = 0;
  e->run = run;
  e->param = param;
  e->argument = argument;
  e->pooled = true;
  event_at(c, e, cycle);
}

void event_dispatch(chip* c) {
  while (c->heap_count > 0 && c->heap[0]->cycle <= c->avr->cycle) {
    event* const e = c->heap[0];
    event_cancel(c, e);
    const event_fn run = e->run;
    void* const param = e->param;
    const uint64_t argument = e->argument;
    c->event_cycle = e->cycle;
    if (e->pooled) {
      e->next_free = c->free_events;
      c->free_events = e;
    }
    c->dispatching = true;
    run(c, param, argument);
    c->dispatching = false;
  }
}

void events_free(chip* c) {
  for (uint32_t i = 0; i < c->heap_count; i++) {
    if (c->heap[i]->pooled) free(c->heap[i]);
  }
  while (c->free_events) {
    event* const e = c->free_events;
    c->free_events = e->next_free;
    free(e);
  }
  free(c->heap);
}
