; modify and duplicate, facts in slots, duplicate facts, default-dynamic, retract in a loop, salience of equals.

(deftemplate job (slot id) (slot state (default new)) (slot score (type FLOAT) (default 0.5)) (multislot log)
  (slot stamp (default-dynamic (gensym))))
(deftemplate link (slot from) (slot to))
(deffacts start (job (id 1)) (job (id 2) (score 1e15)) (job (id 3) (log a "b c" 3)) (count 0))

(defrule note-new ?j <- (job (id ?i) (state new) (log $?l)) => (modify ?j (state seen) (log ?l seen-by-rule)))
(defrule same-again ?j <- (job (id 2) (state seen)) ?c <- (count ?n&:(< ?n 3)) =>
  (retract ?c) (assert (count (+ ?n 1))) (modify ?j (state seen)) (printout t "again " ?n crlf))
(defrule copy ?j <- (job (id 3) (state seen) (score ?s)) (not (job (id 30))) =>
  (duplicate ?j (id 30) (score (/ ?s 3))))
(defrule link ?a <- (job (id ?i)) ?b <- (job (id ?k&:(> ?k ?i))) (not (link (from ?i) (to ?k))) =>
  (assert (link (from ?i) (to ?k))) (printout t ?i "->" ?k crlf))
(defrule equal-one ?j <- (job (id 1) (state seen)) => (printout t "index " (fact-index ?j) crlf)
  (bind ?k (modify ?j (state done) (log)))
  (printout t (fact-slot-value ?k state) (fact-slot-value ?k log) crlf))
(defrule third (declare (salience -1)) (job (score ?s&:(< ?s 0.2))) => (printout t "a third of a half: " ?s crlf))
(defrule sweep (declare (salience -5)) ?l <- (link (from 1)) => (retract ?l))
(defrule negative (declare (salience -6)) (not (link (from 1))) (exists (link)) =>
  (do-for-all-facts ((?l link)) TRUE (printout t ?l:from "-" ?l:to crlf)))
