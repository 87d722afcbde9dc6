// A worst case for the simulator's speed: every peripheral at the recorder's rates and a main loop
// that never sleeps. Receiver on PORTK, servo PWM, TWI slave, 16 channels scanned, GPS in,
// telemetry out, BMP085 bit-banged, the card written in a stream, heartbeat.
#include <util/delay.h>

#include "sd.h"

volatile uint16_t edges, packets, scans, gps_bytes, ticks;
volatile uint32_t next_block, loops;
volatile uint16_t stamp[5], width[5];
static volatile uint8_t last_pins;
static uint16_t sum[16];
static uint8_t channel;
static uint8_t block[512];

ISR(PCINT2_vect) {
  const uint16_t now = TCNT5;
  const uint8_t pins = PINK;
  const uint8_t changed = pins ^ last_pins;
  last_pins = pins;
  for (uint8_t i = 0; i < 5; i++) {
    if (!(changed & (1 << i))) continue;
    if (pins & (1 << i))
      stamp[i] = now;
    else
      width[i] = (uint16_t)(now - stamp[i]);
    edges++;
  }
}
ISR(ADC_vect) {
  sum[channel] += ADC;
  channel = (channel + 1) & 15;
  ADMUX = _BV(REFS0) | (channel & 7);
  ADCSRB = channel & 8 ? _BV(MUX5) : 0;
  ADCSRA |= _BV(ADSC);
  if (channel == 0) scans++;
}
ISR(TWI_vect) {
  if ((TWSR & 0xF8) == 0xA0)
    packets++;
  else
    (void)TWDR;
  TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWIE) | _BV(TWEA);
}
ISR(USART2_RX_vect) {
  (void)UDR2;
  gps_bytes++;
}
ISR(USART3_UDRE_vect) {
  UDR3 = (uint8_t)ticks;
}
ISR(TIMER4_COMPA_vect) {
  OCR4A += 2000;
  ticks++;
  if ((ticks & 3) == 0) PINH = _BV(PH5);
  OCR3A = (uint16_t)(2000 + (ticks & 1023));
}

int main(void) {
  DDRH = _BV(PH5);
  DDRE = _BV(PE3) | _BV(PE4) | _BV(PE5);
  TCCR3A = _BV(COM3A1) | _BV(COM3B1) | _BV(COM3C1) | _BV(WGM31);
  TCCR3B = _BV(WGM33) | _BV(WGM32);
  ICR3 = 39999;
  OCR3A = OCR3B = OCR3C = 2999;
  TCCR3B |= _BV(CS31);
  TCCR5B = _BV(CS51);
  TCCR4B = _BV(CS41);
  TIMSK4 = _BV(OCIE4A);
  PCMSK2 = 0x1F;
  PCICR = _BV(PCIE2);
  ADMUX = _BV(REFS0);
  ADCSRA = _BV(ADEN) | _BV(ADIE) | _BV(ADSC) | 7;
  TWAR = 42 << 1;
  TWAMR = 0x62;
  TWCR = _BV(TWEN) | _BV(TWEA) | _BV(TWIE);
  UBRR2 = 25;
  UCSR2B = _BV(RXEN2) | _BV(RXCIE2);
  UBRR3 = 16;
  UCSR3B = _BV(TXEN3) | _BV(UDRIE3);
  sei();
  finished = sd_init() == 0 && command(25, address(1000)) == 0;
  for (;;) {
    loops++;
    if (spi(0xFF) != 0xFF) continue;
    if (ticks < (uint16_t)(next_block * 37)) continue;
    if (send(0xFC, block, crc16(block, 512)) == 5) next_block++;
  }
}
