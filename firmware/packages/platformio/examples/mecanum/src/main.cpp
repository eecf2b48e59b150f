// A base with four mecanum wheels on computed motors. Replace bench.c by functions for your board: see base.h.
#include <Arduino.h>

#include "base.h"

void setup() {
    Serial.begin(115200);
}

void loop() {
    const bench_result result = bench_run();
    Serial.print("four mecanum wheels: hash ");
    Serial.print((unsigned long)result.hash);
    Serial.println(result.good ? ", as expected" : ", not as expected");
    delay(1000);
}
