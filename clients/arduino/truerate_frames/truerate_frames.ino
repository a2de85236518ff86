// Sends an MPU-6050 (I²C) and a shaft encoder (quadrature on pins 2 and 3) as frames at 200 Hz.
// Copy clients/c/truerate_frame.h beside this file. On the computer:
//   truerate run --source 'serial:/dev/ttyUSB0?baud=230400&format=frames'
#include <Wire.h>
#include "truerate_frame.h"

const uint8_t SENSOR = 0x68;
const float RATE = 0.0174532925f / 131.0f;           // rad/s a count, range 250 °/s
const float ANGLE = 6.2831853f / 2048.0f;            // rad a count of the encoder
const uint32_t PERIOD_US = 5000;

volatile int32_t counts = 0;
truerate_frame frame = {};
uint64_t time_us = 0;
uint32_t last_us = 0, due_us = 0;

void turned() { counts += digitalRead(2) == digitalRead(3) ? 1 : -1; }

void setRegister(uint8_t place, uint8_t value) {
  Wire.beginTransmission(SENSOR);
  Wire.write(place);
  Wire.write(value);
  Wire.endTransmission();
}

void setup() {
  Serial.begin(230400);
  Wire.begin();
  Wire.setClock(400000);
  setRegister(0x6b, 1);                              // awake, clock of the gyro
  setRegister(0x1b, 0);                              // 250 °/s
  setRegister(0x1a, 2);                              // 94 Hz
  pinMode(2, INPUT_PULLUP);
  pinMode(3, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(2), turned, CHANGE);
  frame.flags = TRUERATE_BEGINS;
  frame.fields = TRUERATE_GYRO | TRUERATE_TEMPERATURE | TRUERATE_REF_ANGLE_Z;
  due_us = last_us = micros();
}

int16_t word16() { int16_t high = Wire.read(); return (int16_t)((high << 8) | Wire.read()); }

void loop() {
  uint32_t now = micros();
  if ((int32_t)(now - due_us) < 0) return;
  due_us += PERIOD_US;
  time_us += (uint32_t)(now - last_us);              // micros() begins again every 71 minutes, this does not
  last_us = now;
  Wire.beginTransmission(SENSOR);
  Wire.write(0x41);
  Wire.endTransmission(false);
  if (Wire.requestFrom(SENSOR, (uint8_t)8) != 8) return;
  float celsius = word16() / 340.0f + 36.53f;
  for (int axis = 0; axis < 3; axis++) frame.values[axis] = word16() * RATE;
  noInterrupts();
  int32_t turned_by = counts;
  interrupts();
  frame.values[3] = celsius;
  frame.values[4] = turned_by * ANGLE;
  frame.time_us = time_us;
  uint8_t out[TRUERATE_FRAME_MAX];
  Serial.write(out, truerate_frame_write(&frame, out));
  frame.flags = 0;
  frame.number++;
}
