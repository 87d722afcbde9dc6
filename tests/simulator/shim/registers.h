// ATmega2560 data-space addresses, bits and vectors that the shim models
// (datasheet DS40002211A, sections 14 and 33). Host code cannot include
// avr/io.h, so the few it needs are named here; test_registers.py compares
// every one with avr-libc's header.
#ifndef SIMAVR_BENCH_REGISTERS_H_
#define SIMAVR_BENCH_REGISTERS_H_

#define REG_TIFR0 0x35
#define REG_PCIFR 0x3B
#define REG_EIFR 0x3C
#define REG_EIMSK 0x3D
#define REG_GPIOR0 0x3E
#define REG_EECR 0x3F
#define REG_EEDR 0x40
#define REG_EEARL 0x41
#define REG_EEARH 0x42
#define REG_GTCCR 0x43
#define REG_TCCR0A 0x44
#define REG_TCCR1A 0x80
#define REG_TCCR2A 0xB0
#define REG_TCCR3A 0x90
#define REG_TCCR4A 0xA0
#define REG_TCCR5A 0x120
#define REG_GPIOR1 0x4A
#define REG_GPIOR2 0x4B
#define REG_SPCR 0x4C
#define REG_SPSR 0x4D
#define REG_SPDR 0x4E
#define REG_SMCR 0x53
#define REG_MCUSR 0x54
#define REG_MCUCR 0x55
#define REG_SPMCSR 0x57
#define REG_RAMPZ 0x5B
#define REG_WDTCSR 0x60
#define REG_PCICR 0x68
#define REG_EICRA 0x69
#define REG_EICRB 0x6A
#define REG_PCMSK0 0x6B
#define REG_PCMSK2 0x6D
#define REG_TIMSK0 0x6E
#define REG_ADCL 0x78
#define REG_ADCH 0x79
#define REG_ADCSRA 0x7A
#define REG_ADCSRB 0x7B
#define REG_ADMUX 0x7C
#define REG_TWBR 0xB8
#define REG_TWSR 0xB9
#define REG_TWAR 0xBA
#define REG_TWDR 0xBB
#define REG_TWCR 0xBC
#define REG_TWAMR 0xBD
#define REG_UCSR0A 0xC0
#define REG_UCSR1A 0xC8
#define REG_UCSR2A 0xD0
#define REG_UCSR3A 0x130

// Last I/O register; 0x138..0x1FF are reserved addresses.
#define REG_LAST_IO 0x137

enum vector {
  kVectorReset = 0,
  kVectorInt0 = 1,
  kVectorPcint0 = 9,
  kVectorPcint1 = 10,
  kVectorPcint2 = 11,
  kVectorWdt = 12,
  kVectorSpi = 24,
  kVectorAdc = 29,
  kVectorEeReady = 30,
  kVectorTwi = 39,
  kVectorSpmReady = 40,
  kVectorCount = 57,
};

#endif  // SIMAVR_BENCH_REGISTERS_H_
