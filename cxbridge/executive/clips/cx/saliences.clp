;;; Fawkes' saliences, with their names, and FIRST-LATE, which is ours. The rules of the robot memory
;;; have Fawkes' numbers instead.
;;;
;;; Saliences order whole areas, in one direction: first the facts of the world model
;;; become consistent (WM-...), then the domain model follows (DOMAIN-...), and only then
;;; do rules at salience 0 make decisions. Two rules that fire alternately signal each
;;; other with facts, not with saliences.

(defglobal  ; reports of errors in goals; chains of rules that must end before any other rule fires:
            ; the retraction of goal trees and of facts, and goals that change together
  ?*SALIENCE-FIRST* = 10000     ?*SALIENCE-FIRST-LATE* = 9900)

(defglobal  ; the start: configuration, then the requests
  ?*SALIENCE-INIT* = 9010       ?*SALIENCE-INIT-LATE* = 9000)

(defglobal  ; the world model: ids and keys, then deletions, then additions
  ?*SALIENCE-WM-IDKEY* = 5200
  ?*SALIENCE-WM-SYNC-DEL* = 5100  ?*SALIENCE-WM-SYNC-ADD* = 5000)

(defglobal  ; the domain model: ground, check, apply
  ?*SALIENCE-DOMAIN-GROUND* = 4200
  ?*SALIENCE-DOMAIN-CHECK* = 4100 ?*SALIENCE-DOMAIN-APPLY* = 4000)

(defglobal  ; before and after rules at the default salience, which is 0 (MODERATE: for rules of agents)
  ?*SALIENCE-HIGH* = 1000 ?*SALIENCE-MODERATE* = 500 ?*SALIENCE-LOW* = -1000)

(defglobal  ; clean-up after all other rules; for rules of agents
  ?*SALIENCE-LAST* = -10000)
