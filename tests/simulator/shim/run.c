// Making a chip on Debian's libsimavr and running it. The library's own
// peripherals are taken off after avr_init: what stays is the instruction core,
// the memories and the cycle counter.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_flash.h>
#include <simavr/avr_watchdog.h>

#include "bench.h"
#include "bus.h"

// ---- register hooks
// -------------------------------------------------------------------------

// The core hands a hook one pointer; this table keeps what a module wants
// behind it.
typedef struct hook {
  chip* c;
  read_fn read;
  void* read_param;
  write_fn write;
  void* write_param;
} hook;

typedef struct chip_with_hooks {
  chip c;
  hook hooks[MAX_IOs];
} chip_with_hooks;

static hook* hook_of(chip* c, uint16_t address) {
  return &((chip_with_hooks*)c)->hooks[AVR_DATA_TO_IO(address)];
}

static uint8_t call_read(struct avr_t* avr, avr_io_addr_t address, void* param) {
  (void)avr;
  const hook* const h = param;
  return h->read(h->c, address, h->read_param);
}

static void call_write(struct avr_t* avr, avr_io_addr_t address, uint8_t value, void* param) {
  (void)avr;
  const hook* const h = param;
  h->write(h->c, address, value, h->write_param);
}

void hook_read(chip* c, uint16_t address, read_fn run, void* param) {
  hook* const h = hook_of(c, address);
  h->c = c;
  h->read = run;
  h->read_param = param;
  c->avr->io[AVR_DATA_TO_IO(address)].r.c = call_read;
  c->avr->io[AVR_DATA_TO_IO(address)].r.param = h;
}

void hook_write(chip* c, uint16_t address, write_fn run, void* param) {
  hook* const h = hook_of(c, address);
  h->c = c;
  h->write = run;
  h->write_param = param;
  c->avr->io[AVR_DATA_TO_IO(address)].w.c = call_write;
  c->avr->io[AVR_DATA_TO_IO(address)].w.param = h;
}

uint8_t written_ones(const chip* c, uint8_t value) {
  const avr_t* const avr = c->avr;
  const uint32_t pc = avr->pc & avr->flashend;
  const uint16_t opcode = (uint16_t)(avr->flash[pc] | avr->flash[pc + 1] << 8);
  if ((opcode & 0xFF00) == 0x9A00) return (uint8_t)(1u << (opcode & 7));  // SBI
  if ((opcode & 0xFF00) == 0x9800) return 0;                              // CBI
  return value;
}

// ---- core
// -----------------------------------------------------------------------------------

static void no_sleep(struct avr_t* avr, avr_cycle_count_t cycles) {
  (void)avr, (void)cycles;
}

static void core_message(struct avr_t* avr, const int level, const char* format, va_list list) {
  (void)format, (void)list;
  if (!avr || !avr->custom.data || level > LOG_WARNING) return;
  fault_add(avr->custom.data, kFaultBadAddress, avr->pc);
}

static int core_call(struct avr_io_t* io, uint32_t request, void* param) {
  (void)param;
  chip* const c = (chip*)(void*)((char*)io - offsetof(chip, hooks));
  if (request == AVR_IOCTL_WATCHDOG_RESET)
    watchdog_feed(c);
  else if (request == AVR_IOCTL_FLASH_SPM)
    flash_store(c);
  else
    return -1;
  return 0;
}

static void write_mark(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] = value;
  if (c->log_marks)
    log_add(c, kLogMark, address == REG_GPIOR0 ? 0 : address - REG_GPIOR1 + 1u, value);
}

chip* bench_create(uint64_t seed, uint32_t kind) {
  avr_global_logger_set(core_message);
  const chip_model* const model = model_of(kind);
  if (!model) return NULL;
  avr_t* const avr = avr_make_mcu_by_name(model->name);
  if (!avr) return NULL;
  chip_with_hooks* const whole = calloc(1, sizeof *whole);
  if (!whole) abort();
  chip* const c = &whole->c;
  c->avr = avr;
  c->model = model;
  c->random_state = seed * 2 + 1;
  avr_init(avr);
  avr->custom.data = c;
  avr->frequency = 16000000;
  avr->sleep = no_sleep;
  avr->ioend = model->last_io;  // the core's own table ends here; beyond lie
                                // reserved addresses
  memset(avr->io, 0, sizeof avr->io);
  avr->io_port = NULL;
  avr->reset = NULL;
  avr_cycle_timer_reset(avr);
  avr->interrupts.vector_count = 0;
  c->hooks.kind = "simavr_bench";
  c->hooks.ioctl = core_call;
  avr_register_io(avr, &c->hooks);
  avr_irq_register_notify(avr->interrupts.irq + AVR_INT_IRQ_RUNNING, interrupt_returned, c);
  // The library writes where a wild stack pointer points: give it the whole 64
  // KiB to do so.
  free(avr->data);
  avr->data = calloc(1, 0x10000);
  if (!avr->data) abort();
  c->startup_cycles = 16384 + 65 * 16000;  // low fuse 0xFF: 16K clocks and 65 ms
  c->held = true;
  interrupts_init(c);
  ports_init(c);
  timers_init(c);
  adc_init(c);
  spi_init(c);
  uarts_init(c);
  twi_init(c);
  eeprom_init(c);
  watchdog_init(c);
  flash_init(c);
  hook_write(c, REG_GPIOR0, write_mark, NULL);
  hook_write(c, REG_GPIOR1, write_mark, NULL);
  hook_write(c, REG_GPIOR2, write_mark, NULL);
  for (uint8_t i = 0; i < kPinCount; i++) pin_refresh(c, i);
  return c;
}

void bench_destroy(chip* c) {
  bus_leave(c);
  chip_free_owned(c);
  free(c->watched_pc);
  free(c->spent);
  for (int i = 0; i < 16; i++) free(c->adc.channel[i].point);
  uarts_free(c);
  twi_free(c);
  events_free(c);
  free(c->log);
  c->avr->io_port = NULL;
  free(c->avr->flash);
  free(c->avr->data);
  free(c->avr);
  free(c);
}

static void advance_to(chip* c, uint64_t cycle, uint64_t* account) {
  *account += cycle - c->avr->cycle;
  c->avr->cycle = cycle;
}

static void execute(chip* c, uint64_t room) {
  avr_t* const avr = c->avr;
  if (c->watched_pc) {  // one instruction at a time, about four times slower
    room = 0;
    const uint16_t number = c->watched_pc[(avr->pc & avr->flashend) >> 1];
    if (number) log_add(c, kLogPc, number, avr->pc);
  }
  if (c->spent) room = 0;
  avr->run_cycle_count = room;
  const uint64_t before = avr->cycle;
  const uint32_t at = (avr->pc & avr->flashend) >> 1;
  c->executing = true;
  avr->pc = avr_run_one(avr);
  c->executing = false;
  if (avr->cycle == before) avr->cycle++;  // ran off the end of the flash
  avr->cycle += c->halt_cycles;
  c->halt_cycles = 0;
  c->running_cycles += avr->cycle - before;
  if (c->spent) c->spent[at] += avr->cycle - before;
  if (avr->state != cpu_Running && avr->state != cpu_Sleeping) {
    // The library stops on a push over the registers; the chip goes on, so do
    // we.
    fault_add(c, kFaultBadAddress, avr->pc);
    avr->state = cpu_Running;
  }
  if (avr->state == cpu_Sleeping) {
    const uint8_t mode = avr->data[REG_SMCR];
    if (!(mode & 1))
      avr->state = cpu_Running;  // SE clear: SLEEP does nothing
    else if (mode & 0x0E)
      fault_add(c, kFaultSleepMode, mode);
  }
  const uint16_t sp = (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
  if (sp < c->lowest_sp) c->lowest_sp = sp;
}

// Chips on one bus run together, whichever is asked.
void bench_run(chip* c, uint64_t until) {
  if (c->bus)
    bus_run(c->bus, c, until);
  else
    chip_run(c, until);
}

void chip_run(chip* c, uint64_t until) {
  avr_t* const avr = c->avr;
  c->stop_requested = false;
  while (avr->cycle < until && !c->stop_requested && !c->yield) {
    const uint64_t next = c->heap_count ? c->heap[0]->cycle : UINT64_MAX;
    if (next <= avr->cycle) {
      event_dispatch(c);
      continue;
    }
    const uint64_t horizon = next < until ? next : until;
    if (c->held) {
      advance_to(c, horizon, &c->held_cycles);
      continue;
    }
    const bool enabled = avr->sreg[S_I];
    if (avr->state == cpu_Sleeping) {
      if (c->pending && enabled) {
        avr->state = cpu_Running;
        avr->interrupt_state = 0;
        interrupt_service(c, true);
      } else {
        advance_to(c, horizon, &c->sleeping_cycles);
      }
      continue;
    }
    if (avr->interrupt_state < 0) {
      // The instruction after SEI or RETI always executes before an interrupt
      // is taken.
      avr->interrupt_state = -1;
      execute(c, 0);
      if (avr->interrupt_state == -1) avr->interrupt_state = 0;
      continue;
    }
    if (c->pending && enabled) {
      interrupt_service(c, false);
      continue;
    }
    avr->interrupt_state = 0;
    execute(c, horizon - avr->cycle);
  }
  // What is due exactly now belongs to the past of whoever looks next.
  if (!c->stop_requested && !c->yield) event_dispatch(c);
}

void bench_stop(chip* c) {
  c->stop_requested = true;
  c->avr->run_cycle_count = 0;
}
