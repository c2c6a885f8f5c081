/* Extended Kalman filter of a model whose balance equations are disturbed by white noise; compiled behind simulator.c.
 *
 * The free parameters of the model are its balance inputs, nb of them, then theta. Between samples the mean follows the model,
 * and with it go the transition F, the answer b to a force that is constant over the interval, and d(mean)/d(theta). A white
 * force of intensity q adds b b' q^2 / interval to the covariance. Channels are taken one after the other; NaN is no measurement. */

typedef struct {
  long long nb, sensitivities; /* whether d(innovation)/d(theta) is wanted */
  const double *measured;      /* n rows of ny */
  const double *start, *spread; /* nx: mean and standard deviation of the first state */
  const double *intensity;     /* nb: force times square root of second */
  const double *noise;         /* ny: standard deviation */
  const long long *steps;      /* n: steps in the interval that ends at a sample */
  double *innovation, *variance; /* n rows of ny; variance 0 where nothing was measured */
  double *slope;               /* n rows of ny x ntheta */
  double *ahead, *mean;        /* n rows of nx: before and after the measurements of an instant */
  double *transition, *ahead_covariance, *covariance; /* n rows of nx x nx, or NULL */
  double *push, *reading, *missed; /* n rows of nx x nb, ny x nx, ny: answer to forces, slopes of outputs, what they miss; or NULL */
  double *halved; /* n: most that steps of half the length move a state, in its standard deviations; or NULL, as with sensitivities */
} filter_problem;

/* Places for the values of a Runge-Kutta step: states and slopes at a stage, their sums and rates, and what a model is given. */
typedef struct {
  double *xs, *xsum, *rate, *ss, *ssum, *ks, *u, *d, *dslope, *jf;
} stages;

/* A state that is known exactly should be found to this share of the largest value it has had. */
static const double exact = 1e-4;

/* out (rows x width) = J [dx; dfree] for the first `width` of x0, free. */
static void slopes_of(const problem *m, const function *model, const double *jacobian, int rows, int width, const double *s,
                      double *out) {
  const long long nx = m->nx, nd = m->nd, *place = model->place, *column = model->column;
  memset(out, 0, sizeof(double) * (size_t)(rows * width));
  for (long long r = 0; r < rows; r++) {
    double *to = out + r * width;
    for (long long e = model->first[r]; e < model->other[r]; e++) {
      const double value = jacobian[place[e]], *from = s + column[e] * width;
      for (int c = 0; c < width; c++) to[c] += value * from[c];
    }
    for (long long e = model->other[r]; e < model->first[r + 1]; e++) {
      const long long j = column[e] - nd;
      if (j >= nx && j < width) to[j] += jacobian[place[e]];
    }
  }
}

/* Takes the mean x and its slopes s from sample k - 1 to k; s begins as the identity. */
static void advance(const problem *m, workspace *f, const stages *at, int k, int parts, int width, double *x, double *s) {
  const int nx = (int)m->nx, ns = nx * width;
  const double step = (m->t[k] - m->t[k - 1]) / parts;
  for (int sub = 0; sub < parts; sub++) {
    double t = m->t[k - 1] + sub * step;
    for (int stage = 0; stage < 4; stage++) {
      double reach = node[stage] * step;
      if (stage) {
        add(nx, x, reach, at->rate, at->xs);
        add(ns, s, reach, at->ks, at->ss);
      } else
        memcpy(at->xs, x, sizeof(double) * (size_t)nx);
      read_inputs(m, k - 1, t + reach, t, t + step, at->u, at->d, at->dslope);
      evaluate(f, t + reach, at->xs, at->u, at->d, m->p, at->rate, at->jf);
      slopes_of(m, &m->rate, at->jf, nx, width, stage ? at->ss : s, at->ks);
      add(nx, stage ? at->xsum : x, step * weight[stage], at->rate, at->xsum);
      add(ns, stage ? at->ssum : s, step * weight[stage], at->ks, at->ssum);
    }
    memcpy(x, at->xsum, sizeof(double) * (size_t)nx);
    memcpy(s, at->ssum, sizeof(double) * (size_t)ns);
  }
}

/* Returns n when complete, else the sample at which a value was not finite; -1 without memory. */
int misfit_filter_greybox(const problem *m, const filter_problem *g) {
  const int nx = (int)m->nx, ny = (int)m->ny, n = (int)m->n, nb = (int)g->nb;
  const int ntheta = g->sensitivities ? (int)m->nfree - nb : 0, width = nx + nb + ntheta, ns = nx * width;
  workspace f, h;
  if (!open_workspace(&f, &m->rate) || !open_workspace(&h, &m->output)) return -1;
  size_t size = (size_t)(nx * 6 + ns * 4 + ny * width + ny + (int)m->nu + 2 * (int)m->nd + m->rate.entries + m->output.entries +
                         3 * nx * nx + 3 * nx + ntheta);
  double *memory = calloc(size + 8, sizeof(double));
  if (!memory) return -1;
  double *x = memory, *xs = x + nx, *xsum = xs + nx, *rate = xsum + nx, *s = rate + nx, *ss = s + ns, *ssum = ss + ns;
  double *ks = ssum + ns, *dy = ks + ns, *y = dy + ny * width, *u = y + ny, *d = u + m->nu, *dslope = d + m->nd;
  double *jf = dslope + m->nd, *jy = jf + m->rate.entries, *P = jy + m->output.entries, *A = P + nx * nx, *B = A + nx * nx;
  double *shared = B + nx * nx, *close = shared + nx, *largest = close + nx, *change = largest + nx;
  memcpy(x, g->start, sizeof(double) * (size_t)nx);
  const stages at = {xs, xsum, rate, ss, ssum, ks, u, d, dslope, jf};
  for (int i = 0; i < nx; i++) P[i * nx + i] = g->spread[i] * g->spread[i];
  int k;
  for (k = 0; k < n; k++) {
    if (k > 0) {
      const double span = m->t[k] - m->t[k - 1];
      for (int finer = g->halved != NULL; finer >= 0; finer--) {
        if (finer) memcpy(close, x, sizeof(double) * (size_t)nx);
        for (int i = 0; i < nx; i++)
          for (int j = 0; j < nx + nb; j++) s[i * width + j] = i == j ? 1.0 : 0.0;
        advance(m, &f, &at, k, (int)g->steps[k] * (finer ? 2 : 1), width, finer ? close : x, s);
      }
      for (int i = 0; i < nx; i++) /* A = F P */
        for (int j = 0; j < nx; j++) {
          double sum = 0;
          for (int l = 0; l < nx; l++) sum += s[i * width + l] * P[l * nx + j];
          A[i * nx + j] = sum;
        }
      for (int i = 0; i < nx; i++)
        for (int j = 0; j <= i; j++) {
          double sum = 0;
          for (int l = 0; l < nx; l++) sum += A[i * nx + l] * s[j * width + l];
          for (int b = 0; b < nb; b++)
            sum += s[i * width + nx + b] * s[j * width + nx + b] * g->intensity[b] * g->intensity[b] / span;
          B[i * nx + j] = B[j * nx + i] = sum;
        }
      memcpy(P, B, sizeof(double) * (size_t)(nx * nx));
      for (int i = 0; i < nx && g->halved; i++) {
        largest[i] = fmax(largest[i], fabs(close[i]));
        const double known = fmax(sqrt(P[i * nx + i]), exact * largest[i]);
        if (known > 0) g->halved[k] = fmax(g->halved[k], fabs(close[i] - x[i]) / known);
      }
      if (g->transition)
        for (int i = 0; i < nx; i++) memcpy(g->transition + ((size_t)k * nx + i) * nx, s + i * width, sizeof(double) * (size_t)nx);
      if (g->push)
        for (int i = 0; i < nx; i++) memcpy(g->push + ((size_t)k * nx + i) * nb, s + i * width + nx, sizeof(double) * (size_t)nb);
    }
    if (!all_finite(x, nx) || !all_finite(P, nx * nx)) break;
    memcpy(g->ahead + (size_t)k * nx, x, sizeof(double) * (size_t)nx);
    if (g->ahead_covariance) memcpy(g->ahead_covariance + (size_t)k * nx * nx, P, sizeof(double) * (size_t)(nx * nx));
    read_inputs(m, k < n - 1 ? k : k - 1, m->t[k], m->t[k], m->t[k], u, d, dslope);
    evaluate(&h, m->t[k], x, u, d, m->p, y, jy);
    /* slopes of the outputs in the states: F is not needed here, so its place holds the identity */
    for (int i = 0; i < nx; i++)
      for (int j = 0; j < nx + nb; j++) s[i * width + j] = i == j ? 1.0 : 0.0;
    slopes_of(m, &m->output, jy, ny, width, s, dy);
    if (g->reading)
      for (int c = 0; c < ny; c++) {
        memcpy(g->reading + ((size_t)k * ny + c) * nx, dy + c * width, sizeof(double) * (size_t)nx);
        g->missed[(size_t)k * ny + c] = g->measured[(size_t)k * ny + c] - y[c];
      }
    memcpy(xs, x, sizeof(double) * (size_t)nx);
    memcpy(ks, s, sizeof(double) * (size_t)ns);
    for (int c = 0; c < ny; c++) {
      const double *row = dy + c * width;
      double value = g->measured[(size_t)k * ny + c];
      size_t at = (size_t)k * ny + c;
      g->innovation[at] = g->variance[at] = 0.0;
      if (isnan(value)) {
        if (ntheta) memset(g->slope + at * ntheta, 0, sizeof(double) * (size_t)ntheta);
        continue;
      }
      double variance = g->noise[c] * g->noise[c], surprise = value - y[c];
      for (int i = 0; i < nx; i++) surprise -= row[i] * (x[i] - xs[i]);
      for (int i = 0; i < nx; i++) {
        shared[i] = 0;
        for (int j = 0; j < nx; j++) shared[i] += P[i * nx + j] * row[j];
      }
      for (int i = 0; i < nx; i++) variance += row[i] * shared[i];
      /* row holds the total slope at the prediction; the mean has moved with earlier channels since */
      for (int q = 0; q < ntheta; q++) {
        change[q] = -row[nx + nb + q];
        for (int i = 0; i < nx; i++) change[q] -= row[i] * (s[i * width + nx + nb + q] - ks[i * width + nx + nb + q]);
      }
      g->innovation[at] = surprise;
      g->variance[at] = variance;
      if (ntheta) memcpy(g->slope + at * ntheta, change, sizeof(double) * (size_t)ntheta);
      for (int i = 0; i < nx; i++) {
        const double gain = shared[i] / variance;
        x[i] += gain * surprise;
        for (int q = 0; q < ntheta; q++) s[i * width + nx + nb + q] += gain * change[q];
      }
      for (int i = 0; i < nx; i++)
        for (int j = 0; j < nx; j++) B[i * nx + j] = P[i * nx + j] - shared[i] * shared[j] / variance;
      for (int i = 0; i < nx; i++)
        for (int j = 0; j < nx; j++) P[i * nx + j] = 0.5 * (B[i * nx + j] + B[j * nx + i]);
      for (int i = 0; i < nx; i++)
        if (P[i * nx + i] < 0) P[i * nx + i] = 0;
    }
    memcpy(g->mean + (size_t)k * nx, x, sizeof(double) * (size_t)nx);
    if (g->covariance) memcpy(g->covariance + (size_t)k * nx * nx, P, sizeof(double) * (size_t)(nx * nx));
  }
  free(memory);
  close_workspace(&f);
  close_workspace(&h);
  return k;
}

/* out = left right, all of nx rows and columns; one row is added after the other, which compilers do several columns at a time. */
static void product(int nx, const double *left, const double *right, double *out) {
  memset(out, 0, sizeof(double) * (size_t)(nx * nx));
  for (int i = 0; i < nx; i++)
    for (int l = 0; l < nx; l++) {
      const double value = left[i * nx + l], *from = right + l * nx;
      if (value != 0.0)
        for (int j = 0; j < nx; j++) out[i * nx + j] += value * from[j];
    }
}

static void transposed(int nx, const double *of, double *out) {
  for (int i = 0; i < nx; i++)
    for (int j = 0; j < nx; j++) out[j * nx + i] = of[i * nx + j];
}

/* A covariance that rounding made lopsided is what stands below its diagonal. */
static void mirrored(int nx, double *P) {
  for (int i = 0; i < nx; i++)
    for (int j = 0; j < i; j++) P[j * nx + i] = P[i * nx + j];
}

static double dot(int n, const double *one, const double *other) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += one[i] * other[i];
  return sum;
}

/* Minus twice the log likelihood of a trial, up to a constant, with other noise than it was filtered with: the model in lines about
 * that run. `moved` is by how much the measurements of an instant moved the states then; infinite if a variance is not positive.
 * With a `gradient` of nb + ny also that of the log likelihood by the logarithms of intensities and noise, and the information about
 * them (nb + ny square, without what neighbouring instants share): backwards go r and N, the slope of the log likelihood by the state
 * and its variance, with which the slopes by all disturbances are there (Koopman, Shephard, Biometrika 79, 1992). */
double misfit_relinearised(const long long *sizes, const double *t, const double *transition, const double *push,
                           const double *reading, const double *missed, const double *moved, const double *spread,
                           const double *intensity, const double *noise, double *gradient, double *information) {
  const int n = (int)sizes[0], nx = (int)sizes[1], nb = (int)sizes[2], ny = (int)sizes[3], nn = nx * nx, logs = nb + ny;
  const size_t readings = gradient ? (size_t)n * (size_t)ny : 1;
  double *memory = calloc((size_t)(3 * nn + 3 * nx + nb * (nx + 1)) + readings * (size_t)(nx + 2), sizeof(double)), cost = 0;
  if (!memory) return INFINITY;
  double *P = memory, *A = P + nn, *T = A + nn, *x = T + nn, *r = x + nx, *Nk = r + nx, *share = Nk + nx, *Nb = share + nb;
  double *variances = Nb + nb * nx, *surprises = variances + readings, *all = surprises + readings;
  for (int i = 0; i < nx; i++) P[i * nx + i] = spread[i] * spread[i];
  for (int k = 0; k < n; k++) {
    if (k > 0) {
      const double *F = transition + (size_t)k * nn, *b = push + (size_t)k * nx * nb, span = t[k] - t[k - 1];
      for (int i = 0; i < nx; i++) r[i] = x[i] - moved[(size_t)(k - 1) * nx + i];
      for (int i = 0; i < nx; i++) x[i] = dot(nx, F + i * nx, r);
      transposed(nx, F, T);
      product(nx, F, P, A);
      product(nx, A, T, P);
      mirrored(nx, P);
      for (int q = 0; q < nb; q++) share[q] = intensity[q] * intensity[q] / span;
      for (int i = 0; i < nx; i++)
        for (int q = 0; q < nb; q++) {
          const double value = b[i * nb + q] * share[q];
          if (value != 0.0)
            for (int j = 0; j < nx; j++) P[i * nx + j] += value * b[j * nb + q];
        }
    }
    for (int c = 0; c < ny; c++) {
      const size_t place = (size_t)k * (size_t)ny + (size_t)c, kept = gradient ? place : 0;
      const double *row = reading + place * nx, seen = missed[place];
      double *shared = all + kept * (size_t)nx;
      if (isnan(seen)) continue;
      for (int i = 0; i < nx; i++) shared[i] = dot(nx, P + i * nx, row);
      const double variance = noise[c] * noise[c] + dot(nx, row, shared), surprise = seen - dot(nx, row, x);
      if (!(variance > 0)) {
        free(memory);
        return INFINITY;
      }
      cost += surprise * surprise / variance + log(variance);
      variances[kept] = variance;
      surprises[kept] = surprise;
      for (int i = 0; i < nx; i++) {
        const double gain = shared[i] / variance;
        x[i] += gain * surprise;
        for (int j = 0; j < nx; j++) P[i * nx + j] -= gain * shared[j];
        if (P[i * nx + i] < 0) P[i * nx + i] = 0;
      }
    }
  }
  if (gradient) {
    double *N = P; /* r and N begin at zero */
    memset(N, 0, sizeof(double) * (size_t)nn);
    memset(r, 0, sizeof(double) * (size_t)nx);
    for (int k = n - 1; k >= 0; k--) {
      for (int c = ny - 1; c >= 0; c--) {
        const size_t place = (size_t)k * (size_t)ny + (size_t)c;
        const double *row = reading + place * nx, *shared = all + place * (size_t)nx;
        if (isnan(missed[place])) continue;
        const double variance = variances[place], power = noise[c] * noise[c];
        for (int i = 0; i < nx; i++) Nk[i] = dot(nx, N + i * nx, shared) / variance;
        const double slope = surprises[place] / variance - dot(nx, shared, r) / variance;
        const double certain = 1 / variance + dot(nx, shared, Nk) / variance;
        gradient[nb + c] += power * (slope * slope - certain);
        information[(nb + c) * (logs + 1)] += 2 * power * power * certain * certain;
        for (int i = 0; i < nx; i++) {
          r[i] += row[i] * slope;
          for (int j = 0; j < nx; j++) N[i * nx + j] += row[i] * (certain * row[j] - Nk[j]) - Nk[i] * row[j];
        }
      }
      if (k == 0) break;
      const double *F = transition + (size_t)k * nn, *b = push + (size_t)k * nx * nb, span = t[k] - t[k - 1];
      memset(Nb, 0, sizeof(double) * (size_t)(nb * nx));
      for (int q = 0; q < nb; q++) share[q] = intensity[q] * intensity[q] / span;
      for (int i = 0; i < nx; i++)
        for (int q = 0; q < nb; q++) {
          const double value = b[i * nb + q];
          if (value != 0.0)
            for (int j = 0; j < nx; j++) Nb[q * nx + j] += value * N[i * nx + j];
        }
      for (int q = 0; q < nb; q++) {
        double slope = 0;
        for (int i = 0; i < nx; i++) slope += b[i * nb + q] * r[i];
        for (int p = 0; p <= q; p++) {
          double certain = 0;
          for (int i = 0; i < nx; i++) certain += b[i * nb + p] * Nb[q * nx + i];
          const double both = 2 * share[p] * share[q] * certain * certain;
          information[p * logs + q] += both;
          if (p < q) information[q * logs + p] += both;
          else gradient[q] += share[q] * (slope * slope - certain);
        }
      }
      transposed(nx, F, T);
      memcpy(Nk, r, sizeof(double) * (size_t)nx);
      for (int i = 0; i < nx; i++) r[i] = dot(nx, T + i * nx, Nk);
      product(nx, T, N, A);
      product(nx, A, F, N);
      mirrored(nx, N);
    }
  }
  free(memory);
  return cost;
}
