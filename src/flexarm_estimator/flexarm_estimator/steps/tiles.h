/* Products of small dense matrices, column by column, tile by tile: the sums of a tile stay in registers, which
 * takes a third of the time of going through memory column after column. Every element is summed in the order
 * of its terms, whatever the tile, so an element computed twice has the same bits.
 */
#ifndef FLEXARM_TILES_H
#define FLEXARM_TILES_H

#include "machine_code.h"

#define TALL 8  /* rows of a tile */
#define BROAD 4 /* columns */

#define ALWAYS static inline __attribute__((always_inline))

typedef double pack __attribute__((vector_size(32), aligned(8), may_alias)); /* half a column of a tile */

/* B of a product, element (k, j) at first[k next_k + j next_j]: a matrix or its transpose */
struct right {
    const double *first;
    int64_t next_k, next_j;
};

#define LOAD(a) (*(const pack *)(a))
#define STORE(a, x) (*(pack *)(a) = (x))

/* One tile of out = start + sign A B; start has the leading dimension of out. */
ALWAYS void tile(
    int64_t terms, double sign, const double *a, int64_t lead_a, struct right b, const double *start, double *out,
    int64_t lead)
{
    const double *b0 = b.first, *b1 = b0 + b.next_j, *b2 = b1 + b.next_j, *b3 = b2 + b.next_j;
    pack s0 = LOAD(start), s1 = LOAD(start + lead), s2 = LOAD(start + 2 * lead), s3 = LOAD(start + 3 * lead);
    pack t0 = LOAD(start + 4), t1 = LOAD(start + lead + 4);
    pack t2 = LOAD(start + 2 * lead + 4), t3 = LOAD(start + 3 * lead + 4);
    for (int64_t k = 0; k < terms; k++, a += lead_a) {
        int64_t at = k * b.next_k;
        double f0 = sign * b0[at], f1 = sign * b1[at], f2 = sign * b2[at], f3 = sign * b3[at];
        pack s = LOAD(a), t = LOAD(a + 4);
        s0 += f0 * s, s1 += f1 * s, s2 += f2 * s, s3 += f3 * s;
        t0 += f0 * t, t1 += f1 * t, t2 += f2 * t, t3 += f3 * t;
    }
    STORE(out, s0), STORE(out + lead, s1), STORE(out + 2 * lead, s2), STORE(out + 3 * lead, s3);
    STORE(out + 4, t0), STORE(out + lead + 4, t1), STORE(out + 2 * lead + 4, t2), STORE(out + 3 * lead + 4, t3);
}

/* The same with one column, of as many rows as there are from row i on. */
ALWAYS void column(
    int64_t i, int64_t rows, int64_t terms, double sign, const double *restrict A, int64_t lead_a, struct right b,
    const double *start, double *out)
{
    for (; i + TALL <= rows; i += TALL) {
        pack s = LOAD(start + i), t = LOAD(start + i + 4);
        for (int64_t k = 0; k < terms; k++) {
            double f = sign * b.first[k * b.next_k];
            s += f * LOAD(A + i + k * lead_a), t += f * LOAD(A + i + 4 + k * lead_a);
        }
        STORE(out + i, s), STORE(out + i + 4, t);
    }
    for (; i < rows; i++) {
        double sum = start[i];
        for (int64_t k = 0; k < terms; k++)
            sum += sign * b.first[k * b.next_k] * A[i + k * lead_a];
        out[i] = sum;
    }
}

/* out = start + sign A B, (rows, columns), out and start apart; from the diagonal down at least where ``lower``
   is set: above it lies what is not meant. */
WIDE static void multiply(
    int64_t rows, int64_t columns, int64_t terms, double sign, int lower, const double *A, int64_t lead_a,
    struct right B, const double *start, double *out, int64_t lead)
{
    int is_tiled = rows >= TALL && columns >= BROAD; /* the last tiles cover again what is done */
    for (int64_t done = 0; done < columns; done += is_tiled ? BROAD : 1) {
        int64_t j = is_tiled && done + BROAD > columns ? columns - BROAD : done, first = lower ? j : 0;
        struct right b = {B.first + j * B.next_j, B.next_k, B.next_j};
        if (!is_tiled)
            column(first, rows, terms, sign, A, lead_a, b, start + j * lead, out + j * lead);
        for (; is_tiled && first < rows; first += TALL) {
            int64_t i = first + TALL <= rows ? first : rows - TALL, at = i + j * lead;
            tile(terms, sign, A + i, lead_a, b, start + at, out + at, lead);
        }
    }
}

/* Replace the first columns of the lower triangle of J, (size, size), by those of its Cholesky factor; 0 when it
   has none. ``panel`` has room for BROAD columns of J. */
static int factorise_first(int64_t size, int64_t columns, int64_t lead, double *J, double *panel)
{
    for (int64_t j = 0; j < columns; j += BROAD) {
        int64_t width = columns - j < BROAD ? columns - j : BROAD, rows = size - j;
        double *block = J + j + j * lead;
        multiply(rows, rows < BROAD ? rows : BROAD, j, -1.0, 1, J + j, lead, (struct right){J + j, lead, 1}, block, panel, lead);
        for (int64_t c = 0; c < width; c++) {
            double *done = panel + c * lead;
            if (!(done[c] > 0.0)) /* also when it is NaN */
                return 0;
            double scale = 1.0 / sqrt(done[c]);
            for (int64_t i = c; i < rows; i++)
                block[i + c * lead] = done[i] *= scale;
            for (int64_t next = c + 1; next < width; next++)
                for (int64_t i = next; i < rows; i++)
                    panel[i + next * lead] -= done[next] * done[i];
        }
    }
    return 1;
}

#endif
