/* The board of an e-puck2 for replica.c: a main program over the functions of e-puck2_main-processor (GCtronic), whose Makefile
 * compiles it in place of its src/main.c. Texts come over Bluetooth (SD3). Selector 0: replica; 1: the paper's agent. */
#include <hal.h>
#include "camera/camera.h"
#include "camera/dcmi_camera.h"
#include "ir_remote.h"
#include "motors.h"
#include "msgbus/messagebus.h"
#include "selector.h"
#include "sensors/battery_level.h"
#include "sensors/proximity.h"
#include "serial_comm.h"
#include "../replica.h"
#include <string.h>

#define DARK 60        /* brightness (0 to 255) below which the middle of the image is a robot's skirt, not a white wall */
#define CYCLE_MS 100
/* Keys of the remote control that start the loop: 5, and standby of those without numbers. ir_remote.c stops the
 * wheels at both, and drives the robot at the other numbers. */
#define START_KEY 5
#define STANDBY_KEY 12
static const int AGENT[] = {-7000, -10000, 10000, -10000};
static MUTEX_DECL(one_at_a_time);
messagebus_t bus;
MUTEX_DECL(bus_lock);
CONDVAR_DECL(bus_condvar);

static uint32_t now_ms(void) { return ST2MS(chVTGetSystemTime()); }

void board_wheels(int left, int right) { /* 1000 steps a second are the maximum */
    left_motor_set_speed(left / 10);
    right_motor_set_speed(right / 10);
}

void board_send(const char *text) { chSequentialStreamWrite(&SD3, (const uint8_t *)text, strlen(text)); }

int board_battery_ok(void) { return get_battery_percentage() > 15.0f; }

int board_random(int low, int high) {
    static uint32_t state;
    state = 1664525u * (state ^ chVTGetSystemTime()) + 1013904223u;
    return low + (int)((state >> 8) % (uint32_t)(high - low + 1));
}

static int sight(void) { /* 1 if the middle of the image is dark */
    const uint8_t *row = dcmi_get_last_image_ptr() + 160 * 60;
    int sum = 0;
    for (int column = 76; column < 84; column++) sum += row[column];
    return sum < 8 * DARK;
}

static THD_WORKING_AREA(listener_area, 1024);
static THD_FUNCTION(listen, unused) {
    uint8_t byte;
    (void)unused;
    while (1) {
        if (chSequentialStreamRead(&SD3, &byte, 1) != 1) continue;
        chMtxLock(&one_at_a_time);
        replica_receive(byte, now_ms());
        chMtxUnlock(&one_at_a_time);
    }
}

int main(void) {
    halInit();
    chSysInit();
    messagebus_init(&bus, &bus_lock, &bus_condvar);
    motors_init();
    proximity_start(FAST_UPDATE);
    battery_level_start();
    ir_remote_start();
    serial_start();
    dcmi_start();
    cam_start();
    cam_config(FORMAT_GREYSCALE, SIZE_QQVGA); /* 160 x 120, a byte each */
    dcmi_set_capture_mode(CAPTURE_CONTINUOUS);
    dcmi_prepare();
    dcmi_capture_start();
    chThdSleepMilliseconds(1000);
    calibrate_ir();
    replica_begin(AGENT, get_selector() == 1 ? 4 : 0, now_ms());
    chThdCreateStatic(listener_area, sizeof listener_area, NORMALPRIO, listen, NULL);
    uint8_t toggle = ir_remote_get_toggle();
    systime_t due = chVTGetSystemTime();
    while (1) {
        int proximity[8], seen = sight();
        for (unsigned int k = 0; k < 8; k++) proximity[k] = get_calibrated_prox(k);
        chMtxLock(&one_at_a_time);
        if (ir_remote_get_toggle() != toggle) {
            uint8_t key = ir_remote_get_data();
            toggle = ir_remote_get_toggle();
            if (key == START_KEY || key == STANDBY_KEY) replica_remote(now_ms());
        }
        replica_step(now_ms(), seen, proximity);
        chMtxUnlock(&one_at_a_time);
        due += MS2ST(CYCLE_MS + replica_pause(CYCLE_MS));
        chThdSleepUntil(due);
    }
}
