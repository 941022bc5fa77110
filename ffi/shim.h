/* The C side of the ring around Embree: one call for a whole batch of rays. */
#ifndef GDPT_SHIM_H
#define GDPT_SHIM_H

#include <embree4/rtcore.h>
#include <stddef.h>

/* How many rays go through the tree together. */
enum GdptWidth { GDPT_SINGLE = 1, GDPT_PACKET4 = 4, GDPT_PACKET8 = 8, GDPT_PACKET16 = 16 };

/* Closest hits of `count` rays in blocks of 8, the last block filled from lane 0. `coherent` is 1 for rays
   that start together and point the same way. The floating-point mode is set and restored inside. Widths
   other than 8 copy the rays into Embree's layout for that width and back. */
void gdpt_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count, enum GdptWidth width, int coherent);

/* Any hit for `count` rays in blocks of 8: tfar becomes -inf where a ray is blocked. */
void gdpt_any(RTCScene scene, struct RTCRay8 *blocks, size_t count, enum GdptWidth width, int coherent);

/* What a program in C would do with the same packets of 8, incoherent: nothing around Embree's calls. For
   the benches, as what the Rust side is held against. */
void gdpt_bare_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count);
void gdpt_bare_any(RTCScene scene, struct RTCRay8 *blocks, size_t count);

/* Triangles with holes: those from `first` on are asked about by their number and the point on them. */
struct GdptCutouts {
    const void *mesh;
    int (*is_open)(const void *mesh, unsigned triangle, float u, float v);
    unsigned first;
    /* The floating-point mode outside of the batches, from gdpt_float_mode. */
    unsigned mode;
};

/* Hits on the geometry count only where `is_open` says 0. `cutouts` must stay where it is. */
void gdpt_cut_out(RTCGeometry geometry, const struct GdptCutouts *cutouts);
unsigned gdpt_float_mode(void);

/* Counts the bytes that a device allocates, in *bytes (start at 0). */
void gdpt_count_memory(RTCDevice device, ptrdiff_t *bytes);

#endif
