/* SPDX-License-Identifier: MIT */
/* The C interface of preCICE v3, as far as README.md says, spoken by Sluice's bridge. One
 * participant per program. Whatever goes wrong is printed, and the program ends. */
#ifndef SLUICE_PRECICEC_H
#define SLUICE_PRECICEC_H

#ifdef __cplusplus
extern "C" {
#endif

void precicec_createParticipant(const char *participantName, const char *configFileName,
                                int solverProcessIndex, int solverProcessSize);
void precicec_initialize(void);
void precicec_advance(double computedTimeStepSize);
void precicec_finalize(void);

int precicec_getMeshDimensions(const char *meshName);
int precicec_getDataDimensions(const char *meshName, const char *dataName);
int precicec_isCouplingOngoing(void);
int precicec_isTimeWindowComplete(void);
double precicec_getMaxTimeStepSize(void);
int precicec_requiresInitialData(void);
int precicec_requiresWritingCheckpoint(void);
int precicec_requiresReadingCheckpoint(void);
int precicec_requiresMeshConnectivityFor(const char *meshName);

int precicec_setMeshVertex(const char *meshName, const double *position);
void precicec_setMeshVertices(const char *meshName, int size, const double *positions, int *ids);
int precicec_getMeshVertexSize(const char *meshName);
void precicec_setMeshEdge(const char *meshName, int first, int second);
void precicec_setMeshTriangle(const char *meshName, int first, int second, int third);
void precicec_setMeshTriangles(const char *meshName, int size, const int *ids);

void precicec_writeData(const char *meshName, const char *dataName, int size, const int *ids,
                        const double *values);
void precicec_readData(const char *meshName, const char *dataName, int size, const int *ids,
                       double relativeReadTime, double *values);

void precicec_startProfilingSection(const char *name);
void precicec_stopLastProfilingSection(void);

#ifdef __cplusplus
}
#endif
#endif
