// The service's side of the WebSocket handshake: SHA-1 (FIPS 180-4) and base64 of the client's key.
#ifndef FERVOR_BENCH_HANDSHAKE_H
#define FERVOR_BENCH_HANDSHAKE_H

#include <stdint.h>
#include <stdio.h>
#include <string.h>

static inline uint32_t rotated(uint32_t word, int by) { return word << by | word >> (32 - by); }

static inline void sha1_block(uint32_t state[5], const uint8_t block[64]) {
  uint32_t w[80];
  for (int i = 0; i < 16; i++)
    w[i] = (uint32_t)block[4 * i] << 24 | block[4 * i + 1] << 16 | block[4 * i + 2] << 8 | block[4 * i + 3];
  for (int i = 16; i < 80; i++) w[i] = rotated(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
  uint32_t a = state[0], b = state[1], c = state[2], d = state[3], e = state[4];
  for (int i = 0; i < 80; i++) {
    uint32_t f = i < 20 ? (b & c) | (~b & d) : i < 40 ? b ^ c ^ d : i < 60 ? (b & c) | (b & d) | (c & d) : b ^ c ^ d;
    uint32_t k = i < 20 ? 0x5a827999 : i < 40 ? 0x6ed9eba1 : i < 60 ? 0x8f1bbcdc : 0xca62c1d6;
    uint32_t next = rotated(a, 5) + f + e + k + w[i];
    e = d, d = c, c = rotated(b, 30), b = a, a = next;
  }
  state[0] += a, state[1] += b, state[2] += c, state[3] += d, state[4] += e;
}

// Of at most 119 bytes.
static inline void sha1(const uint8_t *bytes, size_t size, uint8_t digest[20]) {
  uint8_t padded[128] = {0};
  size_t blocks = size < 56 ? 1 : 2;
  memcpy(padded, bytes, size);
  padded[size] = 0x80;
  padded[64 * blocks - 2] = size * 8 >> 8;
  padded[64 * blocks - 1] = size * 8;
  uint32_t state[5] = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
  for (size_t i = 0; i < blocks; i++) sha1_block(state, padded + 64 * i);
  for (int i = 0; i < 20; i++) digest[i] = state[i / 4] >> (24 - 8 * (i % 4));
}

static inline void base64_of_digest(const uint8_t digest[20], char text[29]) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  uint8_t bytes[21] = {0};
  memcpy(bytes, digest, 20);
  for (int i = 0; i < 7; i++) {
    uint32_t three = bytes[3 * i] << 16 | bytes[3 * i + 1] << 8 | bytes[3 * i + 2];
    for (int k = 0; k < 4; k++) text[4 * i + k] = digits[three >> (18 - 6 * k) & 63];
  }
  text[27] = '=';
  text[28] = 0;
}

// Writes the answer to a request for an upgrade, which must carry a key of 24 characters; returns its size.
static inline int upgrade_answer(const char *request, size_t size, char *answer, size_t room) {
  static const char header[] = "Sec-WebSocket-Key: ", guid[] = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  const char *key = memmem(request, size, header, sizeof header - 1);
  uint8_t joined[60], digest[20];
  char accept[29];
  if (!key) return snprintf(answer, room, "HTTP/1.1 426 Upgrade Required\r\nContent-Length: 0\r\n\r\n");
  memcpy(joined, key + sizeof header - 1, 24);
  memcpy(joined + 24, guid, 36);
  sha1(joined, 60, digest);
  base64_of_digest(digest, accept);
  return snprintf(answer, room,
                  "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                  "Sec-WebSocket-Accept: %s\r\nSec-WebSocket-Protocol: fervor.v1.msgpack\r\n\r\n", accept);
}

#endif
