#include "replica.h"
#include <stdio.h>
#include <string.h>

enum { R0, R1, R2, R3, R4, R5 };
static const uint32_t lasts_ms[] = {0, 1000, 8000, 1000, 1000, 7000};
#define LOOP_MS 18000u
#define ALONE_MS 2000u /* without a word from a PC that drives it, has started it, or says that it is there: stand */
#define MOST_LOOPS 5u  /* without a question from the PC: halt */
#define LONGEST 256
#define OBSTACLE 120   /* infrared readings, see docs/robots/arena.md */
#define WALL 400
#define FULL 10000
#define LARGEST 32767  /* of the public protocol's numbers, which have 16 bits */

typedef struct { int sequence, count, speeds[MOST_PARAMETERS]; } model;
static const model NONE = {-1, 0, {0}};

static model waiting, executing, agent;
static int state, trial, called, stood, pauses, heard_alive, asked, manual[2], speed[2], side;
static uint32_t entered_ms, until_ms, alive_ms, asked_ms, heard_ms, turn_until_ms;
static char line[LONGEST + 1];
static int length, in_line, in_binary, arguments;
static unsigned char command, given[4];

static uint16_t crc(const char *text, int count) {
    uint16_t value = 0xFFFF;
    for (int i = 0; i < count; i++) {
        value ^= (uint16_t)((unsigned char)text[i] << 8);
        for (int bit = 0; bit < 8; bit++) value = (uint16_t)(value & 0x8000 ? (value << 1) ^ 0x1021 : value << 1);
    }
    return value;
}

static void say(const char *text) { /* with its checksum */
    char sealed[96];
    snprintf(sealed, sizeof sealed, "%s*%04X\r\n", text, crc(text, (int)strlen(text)));
    board_send(sealed);
}

static void forget(uint32_t now_ms) {
    waiting = executing = NONE;
    state = R0, trial = called = heard_alive = asked = 0;
    entered_ms = heard_ms = now_ms;
}

static void halt(uint32_t now_ms) {
    manual[0] = manual[1] = speed[0] = speed[1] = 0;
    forget(now_ms);
}

static void turn(uint32_t time_ms, int low, int high) {
    turn_until_ms = time_ms + (uint32_t)board_random(low, high);
    side = board_random(0, 1) ? 1 : -1;
}

static void enter(int next, uint32_t time_ms, uint32_t now_ms) {
    char text[48];
    state = next, entered_ms = now_ms, until_ms = time_ms + lasts_ms[next];
    if (next == R3 && waiting.sequence >= 0) executing = waiting, waiting = NONE;
    if (next == R2) turn(time_ms, 0, 1250);
    if (next == R1 && !stood) {
        snprintf(text, sizeof text, "x,STOP,%d,%d", trial, executing.sequence);
        say(text);
    } else if (next == R4) {
        trial = (trial + 1) & 0xFFFF, pauses = 1;
        snprintf(text, sizeof text, "x,START,%d,%d", trial, executing.sequence);
        say(text);
    }
    stood = stood && next == R5;
}

int replica_pause(int cycle_ms) { /* once before each trial, see replica.h */
    if (!pauses) return 0;
    pauses = 0;
    return board_random(0, cycle_ms);
}

void replica_remote(uint32_t now_ms) { stood = 0, enter(R1, now_ms, now_ms); }

void replica_begin(const int *controller, int count, uint32_t now_ms) {
    agent = NONE, agent.count = count;
    if (count > 0) memcpy(agent.speeds, controller, (size_t)count * sizeof *controller);
    manual[0] = manual[1] = speed[0] = speed[1] = stood = length = in_line = in_binary = arguments = 0;
    forget(now_ms);
}

/* Whether the strongest reading reaches a threshold at one of the sensors whose bits are set. */
static int in_the_way(const int proximity[8], int threshold, unsigned sensors) {
    int strongest = 0;
    for (int k = 1; k < 8; k++) if (proximity[k] > proximity[strongest]) strongest = k;
    return proximity[strongest] >= threshold && (sensors >> strongest & 1);
}

static void drive(int left, int right) { board_wheels(left, right); }

void replica_step(uint32_t now_ms, int sight, const int proximity[8]) {
    if (called) called = 0, replica_remote(now_ms);
    if (state == R0) {
        if (now_ms - heard_ms > ALONE_MS) manual[0] = manual[1] = 0; /* nobody commands these wheels any more */
        drive(manual[0], manual[1]);
        return;
    }
    while ((int32_t)(now_ms - until_ms) >= 0) enter(state == R5 ? R1 : state + 1, until_ms, now_ms);
    if (agent.count == 0 && asked && now_ms - asked_ms > MOST_LOOPS * LOOP_MS) halt(now_ms);
    if (heard_alive && now_ms - alive_ms > ALONE_MS) { stood |= state == R5; drive(0, 0); return; }
    if (state == R2) {
        int turns = (int32_t)(turn_until_ms - now_ms) > 0;
        if (!turns && in_the_way(proximity, OBSTACLE, 0xC3)) turn(now_ms, 200, 800), turns = 1; /* up to 75 degrees ahead */
        drive(turns ? -side * FULL : FULL, turns ? side * FULL : FULL);
    } else if (state == R5) {
        const model *in_force = agent.count ? &agent : &executing;
        if (2 * sight + 1 >= in_force->count) { drive(0, 0); return; }
        int left = in_force->speeds[2 * sight], right = in_force->speeds[2 * sight + 1], forward = left + right;
        if (forward && in_the_way(proximity, WALL, forward > 0 ? 0xE7 : 0x3C)) { /* up to 100 degrees from the way */
            int to_left = right >= left;
            left = to_left ? -FULL : FULL, right = -left;
        }
        drive(left, right);
    } else {
        drive(0, 0);
    }
}

/* Read a whole number that fills a field; return 0 if there is none. Large ones become 99999. */
static int whole_number(const char *field, const char *end, int *number) {
    while (field < end && (*field == ' ' || *field == '\t')) field++;
    while (end > field && (end[-1] == ' ' || end[-1] == '\t')) end--;
    int sign = field < end && *field == '-' ? field++, -1 : 1, value = 0;
    if (field == end) return 0;
    for (; field < end; field++) {
        if (*field < '0' || *field > '9') return 0;
        if (value < 99999) value = 10 * value + (*field - '0');
        if (value > 99999) value = 99999;
    }
    *number = sign * value;
    return 1;
}

static int read_model(const char *field, const char *end, model *got) { /* "sequence,p1,...": all of it, or nothing */
    *got = NONE;
    for (int k = 0;; k++) {
        const char *comma = memchr(field, ',', (size_t)(end - field));
        int number;
        if (k > MOST_PARAMETERS || !whole_number(field, comma ? comma : end, &number)) return 0;
        if (k == 0 ? number < 0 || number > 0xFFFF : number < -FULL || number > FULL) return 0;
        if (k == 0) got->sequence = number; else got->speeds[got->count++] = number;
        if (!comma) return got->count > 0;
        field = comma + 1;
    }
}

/* Read the number after a comma as `sscanf(",%d")` does, in 16 bits; return what follows, or NULL and no number. */
static const char *scan(const char *text, int *number) {
    if (!text || *text++ != ',') return NULL;
    while (*text == ' ' || (*text >= '\t' && *text <= '\r')) text++;
    int sign = *text == '-' ? -1 : 1, value = 0;
    if (*text == '-' || *text == '+') text++;
    if (*text < '0' || *text > '9') return NULL;
    for (; *text >= '0' && *text <= '9'; text++) {
        value = 10 * value + (*text - '0');
        if (value > LARGEST) value = LARGEST;
    }
    *number = sign * value;
    return text;
}

static void converse(uint32_t now_ms) {
    char text[96], seal[5], *star = strrchr(line, '*');
    int count = star ? (int)(star - line) : 0;
    if (star) snprintf(seal, sizeof seal, "%04X", crc(line, count));
    for (int i = 0; i < count; i++) if ((unsigned char)line[i] > 127) star = NULL;
    if (!star || strcmp(star + 1, seal)) { say("x,E,checksum"); return; }
    const char *rest = memchr(line, ',', (size_t)count);
    int left = rest ? (int)(star - ++rest) : 0;
    model got;
    if (left == 1 && *rest == 'A') { heard_alive = 1, alive_ms = heard_ms = now_ms; return; }
    asked = 1, asked_ms = heard_ms = now_ms;
    if (heard_alive) alive_ms = now_ms;
    if (left == 1 && *rest == 'H') { halt(now_ms); say("x,H"); return; }
    if (left == 1 && *rest == 'G') { called = heard_alive = 1, alive_ms = now_ms; say("x,G"); return; }
    if (left == 1 && *rest == 'Q') {
        snprintf(text, sizeof text, "x,Q,R%d,%lu,%d,%d,%d", state, (unsigned long)(now_ms - entered_ms), waiting.sequence,
                 executing.sequence, board_battery_ok() ? 1 : 0);
    } else if (left > 1 && rest[0] == 'M' && rest[1] == ',' && read_model(rest + 2, star, &got)) {
        waiting = got;
        snprintf(text, sizeof text, "x,M,%d", got.sequence);
    } else {
        snprintf(text, sizeof text, "x,E,message");
    }
    say(text);
}

static int within(int value) { return value > 1000 ? 1000 : value < -1000 ? -1000 : value; }

static void set_speeds(int left, int right, uint32_t now_ms) {
    speed[0] = left, speed[1] = right; /* what is answered to E, as in the makers' code */
    manual[0] = 10 * within(left), manual[1] = 10 * within(right);
    heard_ms = now_ms;
}

static void obey(uint32_t now_ms) { /* what is left of the public protocol beside a replica's loop */
    char text[48];
    int wheels[2] = {speed[0], speed[1]};
    if (line[0] && strchr("VvbSsEeDd", line[0])) heard_ms = now_ms;
    switch (line[0]) {
    case 'X': case 'x': converse(now_ms); return;
    case 'V': case 'v': board_send("v,Version 1 replica\r\nHW version: 0\r\n"); return;
    case 'b': board_send(board_battery_ok() ? "b,1\r\n" : "b,0\r\n"); return;
    case 'S': case 's': manual[0] = manual[1] = 0; board_send("s\r\n"); return;
    case 'E': case 'e':
        snprintf(text, sizeof text, "e,%d,%d\r\n", speed[0], speed[1]);
        board_send(text);
        return;
    case 'D': case 'd':
        scan(scan(line + 1, &wheels[0]), &wheels[1]);
        set_speeds(wheels[0], wheels[1], now_ms);
        board_send("d\r\n");
        return;
    default: board_send("z,Command not found\r\n");
    }
}

static int16_t word(const unsigned char *two) { return (int16_t)(two[0] | two[1] << 8); }

void replica_receive(unsigned char byte, uint32_t now_ms) {
    int newline = byte == '\r' || byte == '\n';
    if (in_binary) { /* until a zero; only speeds are obeyed, arguments of other commands are skipped */
        if (arguments > 0) {
            given[4 - arguments--] = byte;
            if (!arguments && command == (unsigned char)-'D') set_speeds(word(given), word(given + 2), now_ms);
            return;
        }
        command = byte, in_binary = byte != 0;
        arguments = byte == (unsigned char)-'D' || byte == (unsigned char)-'P' ? 4 : byte == (unsigned char)-'L' ? 2 : 0;
    } else if (in_line == 2) {
        if (newline) line[length] = 0, in_line = length = 0, obey(now_ms);
        else if (length < LONGEST) line[length++] = (char)byte;
    } else if (in_line == 1 || (byte < 128 && byte)) { /* after an end of line whatever comes is text */
        in_line = newline ? 1 : 2;
        if (!newline) line[0] = (char)byte, length = 1;
    } else if (byte) {
        in_binary = 1, arguments = 0;
        replica_receive(byte, now_ms);
    }
}
