/* A replica, or an agent, of Turing Learning: messages, loop, dispersal and wall rule, for any board. See docs/robots/firmware.md. */
#ifndef REPLICA_H
#define REPLICA_H
#include <stdint.h>

#define MOST_PARAMETERS 16

/* What a board provides. Wheel speeds are in units of 0.0001 of the maximum. */
void board_wheels(int left, int right);
void board_send(const char *text);
int board_battery_ok(void);
int board_random(int low, int high); /* from low to high, both included */

/* What a board calls. An agent has a controller, wheel speeds for each sensor state; a replica has none (count 0). */
void replica_begin(const int *controller, int count, uint32_t now_ms);
void replica_receive(unsigned char byte, uint32_t now_ms);                      /* each byte that arrives */
void replica_step(uint32_t now_ms, int sight, const int proximity[8]);          /* ten times a second */
/* By how many milliseconds the next step is to be later, asked after each: a random part of a cycle before each trial. The PC
 * could tell robots by the phases of their cycles otherwise, which no model has. */
int replica_pause(int cycle_ms);
void replica_remote(uint32_t now_ms);                                           /* the remote control was pressed */
#endif
