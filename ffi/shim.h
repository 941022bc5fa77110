/* The C side of the ring around Embree: one call for a whole batch of rays. */
#ifndef GDPT_SHIM_H
#define GDPT_SHIM_H

#include <embree4/rtcore.h>
#include <stddef.h>

/* Closest hits of `count` rays in blocks of 8, the last block filled from lane 0. `coherent` is 1 for rays
   that start together and point the same way. The floating-point mode is set and restored inside. */
void gdpt_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count, int coherent);

/* Any hit for `count` rays in blocks of 8: tfar becomes -inf where a ray is blocked. */
void gdpt_any(RTCScene scene, struct RTCRay8 *blocks, size_t count, int coherent);

#endif
